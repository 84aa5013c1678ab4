// Pictures against the source's: for each file, packs of several settings beside a pack that is as good as exact, all
// drawn with one look and from the same cameras: the whole volume from outside, a third of its size, and a tenth.
// Usage: billow_picture_bench [--size PIXELS] [--pictures FOLDER] SETTING... FILE.vdb...
// A SETTING is the dB of compile's --psnr, or of --metric depth where a d goes before; --pictures writes what was
// drawn, to be looked at.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "billow/format/gpu_size.h"
#include "billow/format/psnr.h"
#include "compile.h"
#include "metric/depth_error.h"
#include "reconstruct.h"
#include "render_image.h"
#include "render_setup.h"

namespace {

namespace command = billow::command;
namespace compiler = billow::compiler;
namespace format = billow::format;
namespace headless = billow::headless;
namespace runtime = billow::runtime;

// Far below what a picture of half an 8-bit step could show.
constexpr double kReferencePsnr = 90;

struct Camera {
  const char* name;
  double part;  // of the volume's longest side that the picture's height spans; 0: all of it in view
};
constexpr Camera kCameras[] = {{"outside", 0}, {"close", 1.0 / 3}, {"near", 0.1}};

struct Setting {
  std::string name;
  compiler::Quality quality;
};

struct Arguments {
  std::vector<Setting> settings;
  std::vector<std::string> files;
  std::string pictures;
  std::uint32_t size = 256;
};

// A value that must be there.
template <class T>
auto take(T&& result, const char* what) {
  if (!result) throw std::runtime_error(std::string("cannot ") + what);
  return *std::forward<T>(result);
}

double decibels(double peak, double squared, std::size_t count) {
  return squared > 0 ? 20 * std::log10(peak / std::sqrt(squared / static_cast<double>(count)))
                     : std::numeric_limits<double>::infinity();
}

float luminance(const float* rgba) {  // Rec. 709
  return 0.2126f * rgba[0] + 0.7152f * rgba[1] + 0.0722f * rgba[2];
}

// How far a picture is from the reference, over pixels that either covers, in decibels. `linear`: radiance, the peak
// being the reference's largest luminance. `display`: after exposure (the reference's 99.9th percentile of luminance
// becomes white, what is brighter is clipped) and the sRGB curve, the peak being white: what a screen shows, where one
// bright spark cannot excuse errors elsewhere. Both over black and over a white background; the worse counts.
struct PictureError {
  double linear, display;
};

class PictureMeasure {
 public:
  explicit PictureMeasure(const headless::Picture& reference) : reference_(reference) {
    std::vector<float> covered;
    for (std::size_t i = 0; i < reference.rgba.size(); i += 4) {
      if (reference.rgba[i + 3] > 0) covered.push_back(luminance(&reference.rgba[i]));
    }
    if (covered.empty()) throw std::runtime_error("an empty picture");
    std::sort(covered.begin(), covered.end());
    peak_ = covered.back();
    white_ = covered[static_cast<std::size_t>(0.999 * static_cast<double>(covered.size() - 1))];
  }

  PictureError of(const headless::Picture& picture) const {
    PictureError error{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    for (const float background : {0.0f, 1.0f}) {
      double linear = 0, display = 0;
      std::size_t count = 0;
      for (std::size_t i = 0; i < picture.rgba.size(); i += 4) {
        const float* a = &reference_.rgba[i];
        const float* b = &picture.rgba[i];
        if (!(a[3] > 0) && !(b[3] > 0)) continue;
        for (int c = 0; c < 3; ++c) {
          linear += square(over(a, c, background * peak_) - over(b, c, background * peak_));
          display += square(shown(over(a, c, background * white_)) - shown(over(b, c, background * white_)));
          ++count;
        }
      }
      error.linear = std::min(error.linear, decibels(double{peak_}, linear, count));
      error.display = std::min(error.display, decibels(1, display, count));
    }
    return error;
  }

 private:
  static double square(float x) { return static_cast<double>(x) * static_cast<double>(x); }
  static float over(const float* rgba, int channel, float background) {
    return rgba[channel] + (1 - rgba[3]) * background;
  }
  float shown(float linear) const {
    const float x = std::clamp(linear / white_, 0.0f, 1.0f);
    return x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1 / 2.4f) - 0.055f;
  }

  const headless::Picture& reference_;
  float peak_ = 0, white_ = 0;
};

struct Drawn {
  headless::Picture pictures[std::size(kCameras)];
};

// Where the gas is: the mean place of the voxels of a grid, weighted by their values, in world units.
std::array<double, 3> centerOf(const format::GridView& view) {
  double sum = 0;
  std::array<double, 3> moment{};
  for (const format::GridView::Leaf& leaf : view.leaves()) {
    const auto weight = static_cast<double>(std::abs(leaf.node.mean - view.frame().background));
    sum += weight;
    for (std::size_t a = 0; a < 3; ++a) moment[a] += weight * (leaf.origin[a] + 3.5);
  }
  const double* m = view.frame().indexToWorld;
  std::array<double, 3> center{};
  for (std::size_t row = 0; row < 3; ++row) {
    center[row] = m[4 * row + 3];
    for (std::size_t a = 0; a < 3; ++a) center[row] += m[4 * row + a] * moment[a] / sum;
  }
  return center;
}

// Draws packs of one file alike: look, cameras and light are the reference's.
class Scene {
 public:
  Scene(const std::string& reference, std::uint32_t size) : gpu_(take(headless::Headless::create({}), "start Vulkan")) {
    const format::Pack pack = take(format::Pack::openFile(reference), "open the reference");
    const format::VolumeRecord& volume = pack.volumes()[0];
    grids_ = runtime::chooseGrids(pack, volume);
    look_ = take(runtime::suggestLook(pack, volume, grids_), "choose a look");
    const runtime::WorldBox box = runtime::worldBox(pack, volume, grids_, 0, 0);
    double longest = 0;
    for (std::size_t a = 0; a < 3; ++a) longest = std::max(longest, box.max[a] - box.min[a]);
    const std::uint32_t seen = grids_.extinction != format::kNone    ? grids_.extinction
                               : grids_.temperature != format::kNone ? grids_.temperature
                                                                     : grids_.flames;
    const auto center = centerOf(take(format::GridView::load(pack, pack.gridFrame(volume, 0, seen)), "load a grid"));
    for (const Camera& camera : kCameras) {
      command::RenderRequest request;
      request.width = request.height = size;
      if (camera.part > 0) {
        const double half = request.camera.fieldOfView / 2.0 * 3.14159265358979 / 180;
        const double distance = camera.part * longest / (2 * std::tan(half));
        request.camera.target = center;
        request.camera.eye = {center[0] + 0.51 * distance, center[1] - 0.82 * distance, center[2] + 0.26 * distance};
      }
      draws_.push_back(command::setUp(request, pack, volume, grids_, look_, 0, 0, false));
    }
    renderer_ = take(runtime::Renderer::create(gpu_->host(), {}), "create a renderer");
  }

  Drawn draw(const std::string& file) {
    const format::Pack pack = take(format::Pack::openFile(file), "open a pack");
    const auto frame = take(renderer_->upload(pack, 0, 0, {.grids = grids_}), "upload a frame");
    Drawn drawn;
    for (std::size_t c = 0; c < draws_.size(); ++c) {
      draws_[c].frame = frame.get();
      drawn.pictures[c] = take(gpu_->render(*renderer_, draws_[c]), "draw");
    }
    gpu_->waitIdle();
    return drawn;
  }

 private:
  std::unique_ptr<headless::Headless> gpu_;
  std::unique_ptr<runtime::Renderer> renderer_;
  runtime::GridChoice grids_;
  runtime::Look look_;
  std::vector<runtime::DrawInfo> draws_;
};

struct Sizes {
  std::uint64_t gpu = 0, disk = 0;
  double psnr = std::numeric_limits<double>::infinity();  // the worst grid's
  double depthPsnr = std::numeric_limits<double>::infinity();
};

Sizes measurePack(const std::string& file, const compiler::ImportedFrame& source) {
  const format::Pack pack = take(format::Pack::openFile(file), "open a pack");
  const format::VolumeRecord& volume = pack.volumes()[0];
  Sizes sizes;
  sizes.disk = std::filesystem::file_size(file);
  for (std::uint32_t g = 0; g < volume.gridCount; ++g) {
    const format::GridFrame& frame = pack.gridFrame(volume, 0, g);
    if ((frame.flags & format::kGridPresent) == 0) continue;
    const auto view = take(format::GridView::load(pack, frame), "load a grid");
    sizes.gpu += format::gpuBytes(frame).total();
    sizes.psnr = std::min(sizes.psnr, format::psnr(frame));
    sizes.depthPsnr =
        std::min(sizes.depthPsnr, compiler::measureDepth(source.grids[g], command::reconstruct(view)).psnr());
  }
  return sizes;
}

void compilePack(const std::string& file, const std::string& output, const compiler::Quality& quality) {
  compiler::CompileOptions options;
  options.quality = quality;
  compiler::compile({file}, output, options, [](const std::string&) {});
}

void writePictures(const Arguments& arguments, const std::string& name, const Drawn& drawn) {
  if (arguments.pictures.empty()) return;
  for (std::size_t c = 0; c < std::size(kCameras); ++c) {
    command::writeWhole(fmt::format("{}/{}_{}.png", arguments.pictures, name, kCameras[c].name),
                        command::encodePng(drawn.pictures[c], 0));
  }
}

void runFile(const Arguments& arguments, const std::string& file, const std::string& work) {
  const auto ignore = [](const std::string&) {};
  const compiler::Plan plan = compiler::planInputs({file}, {}, ignore);
  const compiler::ImportedFrame source = compiler::importFrame(plan.volumes[0], plan.volumes[0].frames[0], {}, ignore);
  const std::string stem = std::filesystem::path(file).stem().string(), begin = stem + "_";
  const std::string pack = work + "/pack.blw";
  compiler::Quality quality;
  quality.psnr = kReferencePsnr;
  compilePack(file, pack, quality);
  Scene scene(pack, arguments.size);
  const Drawn reference = scene.draw(pack);
  writePictures(arguments, begin + "reference", reference);
  for (const auto& [name, asked] : arguments.settings) {
    compilePack(file, pack, asked);
    const Sizes sizes = measurePack(pack, source);
    const Drawn drawn = scene.draw(pack);
    writePictures(arguments, begin + name, drawn);
    fmt::print("| {} | {} | {:.1f} | {:.1f} | {:.2f} | {:.2f} |", stem, name, static_cast<double>(sizes.gpu) * 1e-3,
               static_cast<double>(sizes.disk) * 1e-3, sizes.psnr, sizes.depthPsnr);
    for (std::size_t c = 0; c < std::size(kCameras); ++c) {
      const PictureError error = PictureMeasure(reference.pictures[c]).of(drawn.pictures[c]);
      fmt::print(" {:.1f} / {:.1f} |", error.linear, error.display);
    }
    fmt::print("\n");
    std::fflush(stdout);
  }
}

Arguments parse(int argc, char** argv) {
  Arguments arguments;
  for (int i = 1; i < argc; ++i) {
    const std::string text = argv[i];
    if (text == "--pictures" && i + 1 < argc) {
      arguments.pictures = argv[++i];
    } else if (text == "--size" && i + 1 < argc) {
      arguments.size = static_cast<std::uint32_t>(std::atoi(argv[++i]));
    } else if (std::filesystem::exists(text)) {
      arguments.files.push_back(text);
    } else {
      Setting& setting = arguments.settings.emplace_back();
      setting.name = text;
      if (text[0] == 'd') setting.quality.metric = compiler::Metric::depth;
      setting.quality.psnr = std::stod(text.substr(text[0] == 'd' ? 1 : 0));
    }
  }
  return arguments;
}

}  // namespace

int main(int argc, char** argv) try {
  const Arguments arguments = parse(argc, argv);
  const std::string work =
      fmt::format("{}/billow_pictures.{}", std::filesystem::temp_directory_path().string(), getpid());
  std::filesystem::create_directory(work);
  fmt::print("| file | setting | GPU kB | disk kB | voxel dB | depth dB | outside | close | near |\n");
  fmt::print("|---|---|---|---|---|---|---|---|---|\n");
  for (const std::string& file : arguments.files) runFile(arguments, file, work);
  std::filesystem::remove_all(work);
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "{}\n", error.what());
  return 1;
}
