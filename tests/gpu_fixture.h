// Tests on a Vulkan device, with the validation layer watching: whatever it says fails the test.
#ifndef BILLOW_TESTS_GPU_FIXTURE_H
#define BILLOW_TESTS_GPU_FIXTURE_H

#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>
#include <memory>
#include <utility>
#include <vector>

#include "billow/format/grid_view.h"
#include "billow/headless/headless.h"
#include "sample_pack.h"

namespace billow::tests {

// The value, or the end of the test program with the error.
template <class Expected>
auto valueOf(Expected result, const char* what) {
  if (!result) {
    if constexpr (requires { result.error().message; }) {
      std::cerr << what << ": " << result.error().message << std::endl;
    } else {
      std::cerr << what << ": " << toString(result.error()) << std::endl;
    }
    std::abort();
  }
  return std::move(*result);
}

inline format::Pack openPack(std::vector<std::byte> bytes) {
  return valueOf(format::Pack::open(format::makeMemorySource(std::move(bytes))), "the test's pack");
}

// One volume "v" with one grid in one frame, as `build` fills it.
template <class Build>
std::vector<std::byte> oneGridPack(float background, const Build& build, const std::string& grid = "density") {
  return writePack({}, [&](format::PackWriter& writer) {
    format::PackTables tables = sampleTables("v", {grid}, 1);
    GridFrameBuilder builder(writer, background);
    build(builder);
    tables.gridFrames.push_back(builder.finish(tables));
    return tables;
  });
}

class GpuTest : public testing::Test {
 protected:
  // One device for all tests of a program: making it takes longer than most tests.
  static headless::Headless& gpu() {
    static const auto device = valueOf(headless::Headless::create({.device = {}, .validation = true}), "GPU tests");
    return *device;
  }

  void SetUp() override { before_ = gpu().validationMessages().size(); }
  void TearDown() override {
    gpu().waitIdle();
    const auto& messages = gpu().validationMessages();
    for (std::size_t i = before_; i < messages.size(); ++i) ADD_FAILURE() << messages[i];
  }

  static std::unique_ptr<runtime::Renderer> makeRenderer(const runtime::Config& config = {}) {
    return valueOf(runtime::Renderer::create(gpu().host(), config), "the renderer");
  }

  static std::unique_ptr<runtime::Frame> upload(runtime::Renderer& renderer, const format::Pack& pack,
                                                std::uint32_t frame = 0, const runtime::UploadOptions& options = {}) {
    return valueOf(renderer.upload(pack, 0, frame, options), "upload");
  }

 private:
  std::size_t before_ = 0;
};

}  // namespace billow::tests

#endif  // BILLOW_TESTS_GPU_FIXTURE_H
