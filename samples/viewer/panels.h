// The panels about the picture: look, light, drawing, residency and times at the right, the time line below.
#ifndef BILLOW_VIEWER_PANELS_H
#define BILLOW_VIEWER_PANELS_H

#include <deque>
#include <optional>
#include <string>

#include "document.h"
#include "orbit.h"
#include "painter.h"
#include "window.h"

namespace billow::viewer {

// What there is to tell.
struct Report {
  std::string deviceName;
  std::vector<std::uint8_t> residency = {};  // of the first volume's frames, as Streamer::residency() has it
  Traffic traffic = {};
  StreamBudgets streaming = {};
  std::uint64_t bytesInUse = 0, budget = 0;
  std::optional<PassTimes> times;
  double pictureMilliseconds = 0;  // between two pictures, on the CPU's clock
  float voxelSize = 0;             // of metavoxels
};

// What the user has asked for.
struct Asked {
  bool redraw = false;       // something of the document has changed
  bool remakeSpace = false;  // the size of voxels or the light among them has
  bool frameAll = false, resetCamera = false, screenshot = false;
  std::optional<Choice> choice = {};
  std::optional<std::size_t> regrid = {};       // the volume of which other grids are to be drawn
  std::optional<std::uint64_t> streaming = {};  // bytes of GPU memory that frames may have
};

class Panels {
 public:
  // A Dear ImGui context must exist. `scale`: pixels a unit, to which text is drawn.
  explicit Panels(float scale);

  // Between Dear ImGui's NewFrame and Render.
  Asked draw(Document& document, OrbitCamera& camera, const Report& report);
  // What is left for the picture in the window as it is now, and what was by the last draw().
  const Area& arrange();
  const Area& picture() const { return picture_; }
  // Something of the panels lies over the picture, or is being typed into.
  bool covered() const;
  bool typing() const;

  void toggle() { open_ = !open_; }
  void toggleHelp() { help_ = !help_; }
  // Shown until it is dismissed; the same message once.
  void complain(const std::string& message);
  void dismissErrors() { errors_.clear(); }
  // Shown for a moment.
  void tell(const std::string& message, double now);

  // Pixels of the picture, as a share of the window's, along an edge.
  float resolution() const { return resolution_; }
  bool exr() const { return exr_; }

 private:
  void drawSide(Document& document, OrbitCamera& camera, const Report& report, Asked& asked);
  void drawContents(Document& document, Asked& asked);
  void drawLook(Document& document, Asked& asked);
  void drawGrids(Document& document, Asked& asked);
  void drawLight(Document& document, Asked& asked);
  void drawDrawing(Document& document, const Report& report, Asked& asked);
  void drawCamera(OrbitCamera& camera, Asked& asked);
  void drawInterpolation(Document& document, Asked& asked);
  void drawBelow(Document& document, const Report& report, Asked& asked);
  void drawErrors();
  void drawMessage();
  void drawHelp();

  Area picture_;
  bool open_ = true, help_ = false, exr_ = false;
  float resolution_ = 1;
  int volume_ = 0;       // whose look is shown
  float voxelSize_ = 0;  // while its slider is held
  std::deque<std::string> errors_;
  std::string message_;
  double messageEnd_ = 0;
};

// In panel_strips.cpp.
// Frames of the time line, coloured by the detail in which they are resident, and the time; true where the user takes
// it elsewhere, which is then in `time`.
bool drawTimeStrip(const Timeline& timeline, const std::vector<std::uint8_t>& residency, float height, double& time);
// The frames alone.
void drawFrames(const std::vector<std::uint8_t>& residency);
// Where the bytes are and what the passes take.
void drawResidency(const Report& report, Asked& asked);
void drawTimes(const Report& report);

}  // namespace billow::viewer

#endif  // BILLOW_VIEWER_PANELS_H
