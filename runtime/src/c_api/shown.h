// What a draw shows: instances of which something is resident, and the camera, light and target of both ways to draw.
#ifndef BILLOW_RUNTIME_C_API_SHOWN_H
#define BILLOW_RUNTIME_C_API_SHOWN_H

#include "c_api/context.h"
#include "c_api/convert.h"

namespace billow::c_api {

struct Shown {
  const PlacedInstance* instance = nullptr;
  const VolumeFacts* facts = nullptr;
  runtime::Drawable drawable;
  runtime::Look look;
};

// Those that the host asks for, or all; what is not drawable yet is left out.
Outcome<std::vector<Shown>> shownBy(const BillowContext& context, const BillowDrawInfo& draw);

struct Seen {
  runtime::View view;
  runtime::Sun sun;
  runtime::Quality quality;
  runtime::Background background;
  runtime::ColorFormat colorFormat;
};

Outcome<Seen> seenOf(const BillowDrawInfo& draw);

}  // namespace billow::c_api

#endif  // BILLOW_RUNTIME_C_API_SHOWN_H
