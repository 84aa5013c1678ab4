// The host's device as the runtime takes it.
#ifndef BILLOW_RUNTIME_C_API_DEVICE_H
#define BILLOW_RUNTIME_C_API_DEVICE_H

#include "c_api/problem.h"

namespace billow::c_api {

Outcome<runtime::HostDevice> hostOf(const BillowDevice* device);

}  // namespace billow::c_api

#endif  // BILLOW_RUNTIME_C_API_DEVICE_H
