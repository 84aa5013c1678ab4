/* Compiles as C99 and as C++20, and names every function of billow.h once. What needs no device is called. */
#include <billow/billow.h>
#include <stdio.h>
#include <string.h>

typedef void (*Function)(void);

static const Function functions[] = {
    (Function)billowAddInstance,  (Function)billowAttach,           (Function)billowClose,
    (Function)billowComposite,    (Function)billowCreate,           (Function)billowCreateCompositor,
    (Function)billowCreateSpace,  (Function)billowDestroy,          (Function)billowDestroyCompositor,
    (Function)billowDestroySpace, (Function)billowDetach,           (Function)billowDraw,
    (Function)billowEffectInfo,   (Function)billowInstanceState,    (Function)billowLookAt,
    (Function)billowOpen,         (Function)billowOpenLater,        (Function)billowPackInfo,
    (Function)billowPackState,    (Function)billowPrepare,          (Function)billowReadDone,
    (Function)billowReload,       (Function)billowRemoveInstance,   (Function)billowResultName,
    (Function)billowSeek,         (Function)billowSetBudget,        (Function)billowSetLook,
    (Function)billowSetPlayback,  (Function)billowSetPriority,      (Function)billowSetTransform,
    (Function)billowSpaceShadow,  (Function)billowSpaceStats,       (Function)billowStats,
    (Function)billowSuggestLook,  (Function)billowTakeError,        (Function)billowUpdate,
    (Function)billowUpdateWait,   (Function)billowVersion,          (Function)billowVolumeInfo,
};

static int fail(const char* what) {
  printf("every_function: %s\n", what);
  return 1;
}

int main(void) {
  const double eye[3] = {0, 0, 2}, target[3] = {0, 0, 0}, up[3] = {0, 1, 0};
  BillowDevice device = BILLOW_DEVICE_DEFAULT;
  BillowConfig config = BILLOW_CONFIG_DEFAULT;
  BillowError error = BILLOW_ERROR_DEFAULT;
  BillowView view = BILLOW_VIEW_DEFAULT;
  BillowContext* context = NULL;
  size_t i;
  for (i = 0; i < sizeof(functions) / sizeof(functions[0]); ++i) {
    if (functions[i] == NULL) return fail("a function is missing");
  }
  if (billowVersion() != BILLOW_VERSION) return fail("the library is of another version");
  if (billowCreate(&device, &config, &context, &error) != BILLOW_ERROR_ARGUMENT || context != NULL) {
    return fail("a device without handles was taken");
  }
  if (error.code != BILLOW_ERROR_ARGUMENT || strstr(error.message, "instance") == NULL) return fail(error.message);
  if (strcmp(billowResultName(error.code), "BILLOW_ERROR_ARGUMENT") != 0) return fail("the result has another name");
  billowLookAt(eye, target, up, 90, &view);
  if (view.forward[2] != -1 || view.tanHalfHeight < 0.99f || view.tanHalfHeight > 1.01f) return fail("billowLookAt");
  billowDestroy(NULL);
  return 0;
}
