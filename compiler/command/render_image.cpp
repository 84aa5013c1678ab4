#include "render_image.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfStdIO.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "billow/format/temp_file.h"
#include "tone.h"

namespace billow::command {

std::string encodeExr(const headless::Picture& picture) {
  const std::size_t pixels = std::size_t{picture.width} * picture.height;
  std::vector<Imath::half> color(pixels * 4);
  for (std::size_t i = 0; i < color.size(); ++i) {
    color[i] = Imath::half(std::clamp(picture.rgba[i], -65504.0f, 65504.0f));
  }
  Imf::Header header(static_cast<int>(picture.width), static_cast<int>(picture.height));
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::FrameBuffer frameBuffer;
  const std::size_t pixelBytes = 4 * sizeof(Imath::half);
  const char* const names[] = {"R", "G", "B", "A"};
  for (std::size_t c = 0; c < 4; ++c) {
    header.channels().insert(names[c], Imf::Channel(Imf::HALF));
    char* first = reinterpret_cast<char*>(color.data() + c);
    frameBuffer.insert(names[c], Imf::Slice(Imf::HALF, first, pixelBytes, pixelBytes * picture.width));
  }
  std::vector<float> depth = picture.depth;
  header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
  frameBuffer.insert(
      "Z", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(depth.data()), sizeof(float), sizeof(float) * picture.width));
  Imf::StdOSStream stream;
  {
    Imf::OutputFile file(stream, header);
    file.setFrameBuffer(frameBuffer);
    file.writePixels(static_cast<int>(picture.height));
  }
  return stream.str();
}

std::string encodePng(const headless::Picture& picture, float exposure) {
  const float gain = std::exp2(exposure);
  std::vector<std::uint8_t> rgb;
  rgb.reserve(std::size_t{picture.width} * picture.height * 3);
  for (std::uint32_t y = 0; y < picture.height; ++y) {
    for (std::uint32_t x = 0; x < picture.width; ++x) {
      const float* pixel = &picture.rgba[(std::size_t{y} * picture.width + x) * 4];
      for (int c = 0; c < 3; ++c) {
        const float level = tone::shown(pixel[c] * gain, static_cast<float>(x), static_cast<float>(y));
        rgb.push_back(static_cast<std::uint8_t>(level));
      }
    }
  }
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = picture.width;
  image.height = picture.height;
  image.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = 0;
  if (png_image_write_to_memory(&image, nullptr, &size, 0, rgb.data(), 0, nullptr) == 0) {
    throw std::runtime_error(std::string("libpng: ") + image.message);
  }
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, rgb.data(), 0, nullptr) == 0) {
    throw std::runtime_error(std::string("libpng: ") + image.message);
  }
  bytes.resize(size);
  return bytes;
}

void writeWhole(const std::string& path, const std::string& bytes) {
  format::TempFile file(path);
  file.write(0, std::as_bytes(std::span(bytes)));
  file.commit(bytes.size());
}

}  // namespace billow::command
