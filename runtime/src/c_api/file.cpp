#include "c_api/file.h"

#include "c_api/structs.h"

namespace billow::c_api {
namespace {

using End = void (*)(void* context, bool success);

class HostFile final : public runtime::AsyncSource {
 public:
  explicit HostFile(const BillowFile& file) : file_(file) {}
  HostFile(const HostFile&) = delete;
  HostFile& operator=(const HostFile&) = delete;
  ~HostFile() override {
    if (taken_ && file_.close != nullptr) file_.close(file_.user);
  }

  void take() { taken_ = true; }

  std::uint64_t size() const override { return file_.bytes; }
  void read(std::uint64_t offset, std::span<std::byte> into, runtime::ReadDone done) override {
    const BillowRead read{reinterpret_cast<void (*)()>(done.call), done.context};
    file_.read(file_.user, offset, into.data(), into.size(), read);
  }

 private:
  BillowFile file_;
  bool taken_ = false;
};

}  // namespace

Outcome<runtime::PackSource> sourceOf(const BillowOpenInfo& info) {
  if ((info.path == nullptr) == (info.file == nullptr)) {
    return badArgument("BillowOpenInfo needs one of path and file");
  }
  if (info.path != nullptr) return runtime::PackSource{.path = info.path};
  return given(info.file).and_then([](const BillowFile& file) -> Outcome<runtime::PackSource> {
    if (file.read == nullptr) return badArgument("BillowFile::read is NULL");
    return runtime::PackSource{.source = std::make_shared<HostFile>(file)};
  });
}

void takeFile(const runtime::PackSource& source) {
  if (source.source != nullptr) static_cast<HostFile&>(*source.source).take();
}

}  // namespace billow::c_api

extern "C" void billowReadDone(BillowRead read, uint32_t success) {
  billow::c_api::quietly([&] { reinterpret_cast<billow::c_api::End>(read.call)(read.context, success != 0); });
}
