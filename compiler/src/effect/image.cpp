#include "effect/image.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>

#include "import/input_notes.h"
#include "stages.h"

namespace billow::compiler {
namespace {

constexpr std::int64_t kMostEdge = 8192, kMostPixels = std::int64_t{1} << 24;

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw Error(Fault::input, fmt::format("{}: {}", path, what));
}

void resize(const std::string& path, std::int64_t width, std::int64_t height, Image& image) {
  if (width < 1 || height < 1 || width > kMostEdge || height > kMostEdge || width * height > kMostPixels) {
    fail(path, fmt::format("it has {}x{} pixels; expected 1 to {} an edge, and at most {}", width, height, kMostEdge,
                           kMostPixels));
  }
  image.width = static_cast<std::uint32_t>(width);
  image.height = static_cast<std::uint32_t>(height);
  image.pixels.resize(std::size_t{image.width} * image.height);
}

Image readExr(const std::string& path) {
  Image image;
  Imf::InputFile file(path.c_str(), 1);
  const Imath::Box2i window = file.header().dataWindow();
  resize(path, std::int64_t{window.max.x} - window.min.x + 1, std::int64_t{window.max.y} - window.min.y + 1, image);
  const Imf::ChannelList& channels = file.header().channels();
  const bool colour = channels.findChannel("R") != nullptr && channels.findChannel("G") != nullptr &&
                      channels.findChannel("B") != nullptr;
  if (!colour && channels.findChannel("Y") == nullptr) fail(path, "no channels R, G and B, nor Y");
  constexpr std::size_t kStride = sizeof(image.pixels[0]);
  Imf::FrameBuffer target;
  // OpenEXR addresses pixels by their coordinates in the window.
  const std::ptrdiff_t shift =
      window.min.x + static_cast<std::ptrdiff_t>(window.min.y) * static_cast<std::ptrdiff_t>(image.width);
  for (std::size_t c = 0; c < (colour ? 3 : 1); ++c) {
    static constexpr const char* kNames[] = {"R", "G", "B"};
    char* base = reinterpret_cast<char*>(&image.pixels[0][c]) - shift * static_cast<std::ptrdiff_t>(kStride);
    target.insert(colour ? kNames[c] : "Y", Imf::Slice(Imf::FLOAT, base, kStride, kStride * image.width));
  }
  file.setFrameBuffer(target);
  file.readPixels(window.min.y, window.max.y);
  if (!colour) {
    for (auto& pixel : image.pixels) pixel[1] = pixel[2] = pixel[0];
  }
  return image;
}

// libpng's own integers make the values linear: the same on every machine.
Image readPng(const std::string& path) {
  Image image;
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&png, path.c_str()) == 0) fail(path, fmt::format("not a PNG: {}", png.message));
  png.format = PNG_FORMAT_LINEAR_RGB_ALPHA;
  try {
    resize(path, png.width, png.height, image);
  } catch (...) {
    png_image_free(&png);
    throw;
  }
  std::vector<std::uint16_t> values(image.pixels.size() * 4);
  if (png_image_finish_read(&png, nullptr, values.data(), 0, nullptr) == 0) {
    fail(path, fmt::format("a broken PNG: {}", png.message));
  }
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) image.pixels[i][c] = static_cast<float>(values[i * 4 + c]) / 65535;
  }
  return image;
}

}  // namespace

std::array<double, 3> Image::sample(double u, double v, bool wrap) const {
  const double x = u * width - 0.5, y = v * height - 0.5;
  const double left = std::floor(x), top = std::floor(y);
  const auto pixel = [&](double column, double row) {
    const double lastX = width - 1.0, lastY = height - 1.0;
    if (wrap) column -= std::floor(column / width) * width;
    const auto i = static_cast<std::size_t>(std::clamp(column, 0.0, lastX));
    return pixels[static_cast<std::size_t>(std::clamp(row, 0.0, lastY)) * width + i];
  };
  std::array<double, 3> result{};
  for (std::size_t c = 0; c < 3; ++c) {
    const auto row = [&](double at) {
      const double a = static_cast<double>(pixel(left, at)[c]), b = static_cast<double>(pixel(left + 1, at)[c]);
      return a + (b - a) * (x - left);
    };
    result[c] = row(top) + (row(top + 1) - row(top)) * (y - top);
  }
  return result;
}

Image readImage(const std::string& path) {
  noteInput(path);
  if (!std::filesystem::is_regular_file(path)) throw Error(Fault::file, path + ": no such picture");
  const std::string extension = std::filesystem::path(path).extension().string();
  if (extension != ".exr" && extension != ".png") fail(path, "expected a picture *.exr or *.png");
  Image image;
  try {
    image = extension == ".exr" ? readExr(path) : readPng(path);
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {  // OpenEXR's
    fail(path, fmt::format("not a usable EXR: {}", error.what()));
  }
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    for (const float value : image.pixels[i]) {
      if (!std::isfinite(value)) fail(path, fmt::format("pixel {},{} is {}", i % image.width, i / image.width, value));
    }
  }
  return image;
}

}  // namespace billow::compiler
