#include <algorithm>
#include <cmath>

#include "c_api/context.h"
#include "c_api/convert.h"

namespace billow::c_api {
namespace {

Outcome<void> update(BillowContext& context, const BillowUpdateInfo* info) {
  const auto i = given(info);
  if (!i) return tl::unexpected(i.error());
  if (!(i->seconds >= 0) || !std::isfinite(i->seconds)) {
    return badArgument("BillowUpdateInfo::seconds is outside of its range");
  }
  if (i->pixelsHigh == 0) return badArgument("BillowUpdateInfo::pixelsHigh is 0");
  runtime::UpdateInfo now{.seconds = i->seconds, .pixelsHigh = i->pixelsHigh};
  if (i->view != nullptr) {
    const auto view = viewOf(i->view);
    if (!view) return tl::unexpected(view.error());
    now.view = *view;
  }
  context.streamer->update(now);
  takeIn(context);
  return {};
}

BillowStats statsOf(const BillowContext& context) {
  const runtime::StreamStats from = context.streamer->stats();
  BillowStats stats = BILLOW_STATS_DEFAULT;
  stats.instances = from.instances;
  stats.updates = from.updates;
  stats.bytesRead = from.bytesRead;
  stats.bytesDecompressed = from.bytesDecompressed;
  stats.bytesUploaded = from.bytesUploaded;
  stats.bytesEvicted = from.bytesEvicted;
  stats.framesLoaded = from.framesLoaded;
  stats.framesEvicted = from.framesEvicted;
  stats.framesLate = from.framesLate;
  stats.gpuBytes = from.gpuBytes;
  stats.gpuAllocated = from.gpuAllocated;
  stats.gpuPeak = from.gpuPeak;
  stats.gpuBytesInAll = context.renderer != nullptr ? context.renderer->bytesInUse() : 0;
  stats.cpuBytes = from.cpuBytes;
  stats.cpuPeak = from.cpuPeak;
  stats.framesResident = from.framesResident;
  stats.loadsQueued = from.loadsQueued;
  stats.loadsReading = from.loadsReading;
  stats.loadsDecoding = from.loadsDecoding;
  stats.loadsUploading = from.loadsUploading;
  stats.instancesHeld = from.instancesHeld;
  stats.instancesCoarse = from.instancesCoarse;
  stats.instancesEmpty = from.instancesEmpty;
  copyArray(from.missingBricks, stats.missingBricks);
  return stats;
}

// The context's own come first: they are older.
Outcome<void> takeError(BillowContext& context, BillowError* into) {
  if (!context.late.empty()) {
    report(context.late.front(), into);
    context.late.erase(context.late.begin());
    return {};
  }
  const auto error = context.streamer->takeError();
  if (!error) return notReady("there is no error");
  report({.result = resultOf(error->code),
          .message = error->message,
          .pack = error->asset.value,
          .volume = error->volume,
          .frame = error->frame,
          .page = error->page.value_or(BILLOW_NONE)},
         into);
  return {};
}

}  // namespace
}  // namespace billow::c_api

extern "C" {

using namespace billow::c_api;  // NOLINT(google-build-using-namespace)

BillowResult billowUpdate(BillowContext* context, const BillowUpdateInfo* info, BillowError* error) {
  return answering(error, [&] { return update(*context, info); });
}

void billowUpdateWait(const BillowContext* context, BillowWait* wait) {
  BillowWait value = BILLOW_WAIT_DEFAULT;
  if (context->renderer != nullptr) {
    const billow::runtime::UploadWait from = context->streamer->wait();
    value.semaphore = from.semaphore;
    value.value = from.value;
  }
  giveBack(value, wait);
}

void billowStats(const BillowContext* context, BillowStats* stats) {
  giveBack(statsOf(*context), stats);
}

BillowResult billowTakeError(BillowContext* context, BillowError* error) {
  return answering(error, [&] { return takeError(*context, error); });
}

}  // extern "C"
