// What `billow render` is asked for: from the command line, or from a scene file that the command line overrides.
#ifndef BILLOW_COMMAND_RENDER_REQUEST_H
#define BILLOW_COMMAND_RENDER_REQUEST_H

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "billow/runtime/runtime.h"
#include "billow/runtime/stream.h"

namespace billow::command {

struct Refusal {
  int code;  // Exit
  std::string message;
};
template <class T>
using Checked = tl::expected<T, Refusal>;

using Triple = std::array<float, 3>;

struct CameraRequest {
  std::optional<std::array<double, 3>> eye, target;
  float fieldOfView = 35;  // degrees, vertical
};

struct LookRequest {
  format::LookRecord record{};  // what it sets replaces the pack's and what was fitted
  std::optional<std::uint32_t> scatteringOrders;
  float density = 1;  // factor on the extinction scale
  float fire = 1;     // factor on the emission scale
};

struct BackgroundRequest {
  enum class Kind { automatic, none, colors } kind = Kind::automatic;
  Triple bottom{}, top{};
};

// Names of grids; "none" leaves a role out; absent: by the pack's roles.
struct GridNames {
  std::optional<std::string> extinction, temperature, flames;
};

enum class Method { direct, metavoxel };

using Matrix = std::array<double, 12>;  // 3x4, row-major
inline constexpr Matrix kIdentity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

// What a volume shows after its last frame: that frame, all of them again, or nothing.
enum class AfterLast { hold, loop, vanish };

struct VolumeRequest {
  std::string pack;
  std::optional<std::string> volume;  // needed where the pack has several
  std::uint32_t level = 0;            // 0, or a coarser level of it
  GridNames grids;
  LookRequest look;  // over the request's
  Matrix transform = kIdentity;
  double begin = 0;                       // when its first frame shows, seconds
  std::optional<double> framesPerSecond;  // default: the pack's
  AfterLast after = AfterLast::hold;
  std::optional<std::int32_t> frame;  // the only one to show, at all times
  std::string place;                  // "SCENE.json: volumes[0]"; "" where the command line asks for it
};

struct EffectRequest {
  std::string pack, name;
  Matrix transform = kIdentity;  // a format::similarityOf()
  double begin = 0;              // seconds
  float density = 1, fire = 1;   // factors on extinction and emission
  std::string place;             // as a volume's
};

struct RenderRequest {
  std::vector<VolumeRequest> volumes;  // drawn by the direct method: one
  std::vector<EffectRequest> effects;  // drawn by metavoxels, beside volumes or alone
  // Whether a scene lists all of these; its frame N is N / framesPerSecond seconds after its begin. Else there is a
  // volume of a pack, whose frames are numbered as its source does, or effects alone.
  bool scene = false;
  double framesPerSecond = 24;
  Method method = Method::direct;
  std::optional<double> time;                                         // where no frame is asked for, seconds
  runtime::Interpolation interpolate = runtime::Interpolation::hold;  // of volumes between frames
  float velocityScale = 1;                                            // world units a second of a velocity grid's 1
  std::optional<double> voxelSize;                                    // of metavoxels, world units
  float surroundings = 0;                                             // of metavoxels, as runtime::Scattering has them
  std::uint32_t bounces = 2;
  std::int32_t firstFrame = 0, lastFrame = 0;
  bool range = false;
  std::string output;
  std::uint32_t width = 960, height = 540;
  CameraRequest camera;
  std::optional<char> up;  // 'y' or 'z'; default: as the data rises
  std::optional<std::array<float, 3>> sunDirection;
  std::optional<Triple> sunColor;
  std::optional<float> sunIntensity;
  LookRequest look;
  BackgroundRequest background;
  float exposure = 0;  // stops
  runtime::Filter filter = runtime::Filter::trilinear;
  float step = 1;  // voxels
  runtime::Filter shadows = runtime::Filter::nearest;
  std::uint64_t gpuBudget = std::uint64_t{1} << 30;
  std::optional<std::uint32_t> device;
};

// Reads and checks a scene file (spec/scene.schema.json) into `request`; relative pack paths are relative to the scene.
Checked<void> readScene(const std::string& path, RenderRequest& request);

// The texts of options; each gives a sentence with what was expected where it cannot be read.
Checked<void> parseFrames(const std::string& text, RenderRequest& request);      // N or N-M
Checked<void> parseSize(const std::string& text, RenderRequest& request);        // WxH
Checked<void> parseCamera(const std::string& text, RenderRequest& request);      // x,y,z:x,y,z[:degrees]
Checked<void> parseBackground(const std::string& text, RenderRequest& request);  // none, r,g,b or r,g,b:r,g,b
struct Bounds {
  double low, high;
};
Checked<Triple> parseTriple(const std::string& text, const char* option, const Bounds& bounds);

inline constexpr double kLargest = 1e9;  // of colours, intensities, factors and components of a direction
inline constexpr std::uint32_t kLargestPicture = 16384;  // pixels an edge
inline constexpr std::int64_t kMostFrames = 100000;      // of one call

}  // namespace billow::command

#endif  // BILLOW_COMMAND_RENDER_REQUEST_H
