// Making a Streamer upon any transport: what Streamer::create() does with the real one.
#ifndef BILLOW_RUNTIME_STREAM_STREAMER_H
#define BILLOW_RUNTIME_STREAM_STREAMER_H

#include <functional>
#include <memory>

#include "planning.h"
#include "transport.h"

namespace billow::runtime {

// Called at creation, and again by Streamer::attach() with the renderer's device. `wake` is as Transport has it.
using MakeTransport =
    std::function<Result<std::unique_ptr<Transport>>(Device* device, const StreamConfig& config, const Wake& wake)>;

Result<std::unique_ptr<Streamer>> makeStreamer(const StreamConfig& config, Device* device, MakeTransport make,
                                               PlanOn on = PlanOn::thread);

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_STREAMER_H
