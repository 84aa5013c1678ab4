#include "c_api/problem.h"

#include <cstring>

#include "c_api/structs.h"

namespace billow::c_api {
namespace {

// Cut at a whole character of UTF-8.
void copyText(const char* from, std::size_t length, char* into, std::size_t room) {
  if (length >= room) {
    length = room - 1;
    while (length > 0 && (static_cast<unsigned char>(from[length]) & 0xc0u) == 0x80u) --length;
  }
  std::memcpy(into, from, length);
  into[length] = 0;
}

}  // namespace

BillowResult resultOf(runtime::ErrorCode code) {
  switch (code) {
    case runtime::ErrorCode::pack:
      return BILLOW_ERROR_PACK;
    case runtime::ErrorCode::budget:
      return BILLOW_ERROR_BUDGET;
    case runtime::ErrorCode::unsupported:
      return BILLOW_ERROR_UNSUPPORTED;
    case runtime::ErrorCode::vulkan:
      return BILLOW_ERROR_VULKAN;
    case runtime::ErrorCode::deviceLost:
      return BILLOW_ERROR_DEVICE_LOST;
    case runtime::ErrorCode::argument:
      return BILLOW_ERROR_ARGUMENT;
    case runtime::ErrorCode::memory:
      break;
  }
  return BILLOW_ERROR_MEMORY;
}

tl::unexpected<Problem> problem(const runtime::Error& error) {
  return tl::unexpected(Problem{.result = resultOf(error.code), .message = error.message});
}

tl::unexpected<Problem> badArgument(std::string message) {
  return tl::unexpected(Problem{.result = BILLOW_ERROR_ARGUMENT, .message = std::move(message)});
}

tl::unexpected<Problem> notReady(std::string message) {
  return tl::unexpected(Problem{.result = BILLOW_NOT_READY, .message = std::move(message)});
}

BillowResult report(const Problem& problem, BillowError* error) noexcept {
  BillowError filled = BILLOW_ERROR_DEFAULT;
  filled.code = problem.result;
  filled.pack.id = problem.pack;
  filled.volume = problem.volume;
  filled.frame = problem.frame;
  filled.page = problem.page;
  // Where memory ran out there is none for a text of its own.
  const char* text = problem.message.empty() ? "out of memory" : problem.message.c_str();
  // An older host's struct may have room for less.
  const std::size_t before = offsetof(BillowError, message);
  const std::size_t size = error == nullptr ? 0 : error->size;
  const std::size_t room = size > before ? std::min(size - before, sizeof(filled.message)) : 0;
  if (room > 0) copyText(text, std::strlen(text), filled.message, room);
  giveBack(filled, error);
  return problem.result;
}

}  // namespace billow::c_api

extern "C" {

uint32_t billowVersion(void) {
  return BILLOW_VERSION;
}

const char* billowResultName(BillowResult result) {
  switch (result) {
#define BILLOW_NAME(name) \
  case name:              \
    return #name;
    BILLOW_NAME(BILLOW_OK)
    BILLOW_NAME(BILLOW_NOT_READY)
    BILLOW_NAME(BILLOW_ERROR_PACK)
    BILLOW_NAME(BILLOW_ERROR_BUDGET)
    BILLOW_NAME(BILLOW_ERROR_UNSUPPORTED)
    BILLOW_NAME(BILLOW_ERROR_VULKAN)
    BILLOW_NAME(BILLOW_ERROR_ARGUMENT)
    BILLOW_NAME(BILLOW_ERROR_MEMORY)
    BILLOW_NAME(BILLOW_ERROR_DEVICE_LOST)
#undef BILLOW_NAME
    default:
      return "BILLOW_RESULT_UNKNOWN";
  }
}

}  // extern "C"
