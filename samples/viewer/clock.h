// Where a volume is at a moment of the time line, and how it goes on from there, as a streamer is told. No window and
// no GPU, so that it can be tested alone.
#ifndef BILLOW_VIEWER_CLOCK_H
#define BILLOW_VIEWER_CLOCK_H

#include "billow/runtime/stream.h"
#include "render_contents.h"
#include "timeline.h"

namespace billow::viewer {

struct Clock {
  double time = 0;  // seconds from the volume's first frame
  runtime::Playback playback = {};
  enum class Part { before, within, after } part = Part::within;  // of the sequence
  bool shown = false;
  bool wanted = false;  // shown, or soon
};

Clock clockOf(const command::PlacedVolume& volume, const command::RenderRequest& request, const Timeline& timeline);

}  // namespace billow::viewer

#endif  // BILLOW_VIEWER_CLOCK_H
