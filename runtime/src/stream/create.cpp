#include "streamer.h"

namespace billow::runtime {

Result<std::unique_ptr<Streamer>> Streamer::create(Renderer& renderer, const StreamConfig& config) {
  return makeStreamer(config, &renderer.device(), [](Device* device, const StreamConfig& wanted, const Wake& wake) {
    return Transport::create(*device, wanted, wake);
  });
}

}  // namespace billow::runtime
