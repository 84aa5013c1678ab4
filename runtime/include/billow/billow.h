/* billow: packs of smoke, fire and cloud, streamed and drawn on a game's own Vulkan device.
 *
 * A game makes four calls: open, budget, update, draw.
 *
 *   BillowDevice device = BILLOW_DEVICE_DEFAULT;         // the game's device, and a queue that it lends
 *   device.instance = ...;
 *   BillowConfig config = BILLOW_CONFIG_DEFAULT;
 *   config.gpuBudget = 256u << 20;                       // budget
 *   BillowError error = BILLOW_ERROR_DEFAULT;
 *   BillowContext* billow = NULL;
 *   if (billowCreate(&device, &config, &billow, &error) != BILLOW_OK) puts(error.message);
 *
 *   BillowOpenInfo file = BILLOW_OPEN_INFO_DEFAULT;
 *   file.path = "fire.blw";
 *   BillowPack pack;
 *   if (billowOpen(billow, &file, &pack, &error) != BILLOW_OK) puts(error.message);  // open
 *   BillowInstanceInfo fire = BILLOW_INSTANCE_INFO_DEFAULT;
 *   fire.pack = pack;
 *   BillowInstance instance;
 *   if (billowAddInstance(billow, &fire, &instance, &error) != BILLOW_OK) puts(error.message);
 *   BillowSpaceInfo spaceInfo = BILLOW_SPACE_INFO_DEFAULT;
 *   BillowSpace* space = NULL;
 *   if (billowCreateSpace(billow, &spaceInfo, &space, &error) != BILLOW_OK) puts(error.message);
 *
 *   // each frame of the game
 *   BillowUpdateInfo moment = BILLOW_UPDATE_INFO_DEFAULT;
 *   moment.seconds = secondsSinceTheFrameBefore;
 *   moment.view = &view;
 *   if (billowUpdate(billow, &moment, &error) != BILLOW_OK) puts(error.message);     // update
 *   while (billowTakeError(billow, &error) == BILLOW_OK) puts(error.message);
 *   BillowDrawInfo draw = BILLOW_DRAW_INFO_DEFAULT;
 *   draw.space = space;
 *   draw.view = &view;
 *   draw.width = 1920, draw.height = 1080;               // of two images with VK_IMAGE_USAGE_STORAGE_BIT,
 *   draw.color = colorView, draw.depth = depthView;      // now in VK_IMAGE_LAYOUT_GENERAL
 *   if (billowDraw(billow, commands, &draw, &error) != BILLOW_OK) puts(error.message);  // draw
 *   BillowWait uploads = BILLOW_WAIT_DEFAULT;
 *   billowUpdateWait(billow, &uploads);
 *   VkSemaphoreSubmitInfo wait = {VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO, NULL, uploads.semaphore, uploads.value,
 *                                 VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, 0};
 *   submit.waitSemaphoreInfoCount = 1, submit.pWaitSemaphoreInfos = &wait;              // of vkQueueSubmit2()
 *
 * The host owns instance, device, queues, images, command buffers and the frame loop. billow enables nothing and waits
 * for nothing. It submits uploads alone, to the queue that the host lends. No Vulkan symbol is linked: all functions
 * come through BillowDevice::getInstanceProcAddr.
 *
 * Structs. Each begins with `size`, which its BILLOW_..._DEFAULT sets to its sizeof where the host is compiled, beside
 * values that make a good picture. Fields are only ever appended, never between others and never in padding: a newer
 * library reads an older, smaller struct and takes the default for what it lacks, and fills no more of an older struct
 * than it has. A struct larger than the library knows is BILLOW_ERROR_ARGUMENT, unless all that is beyond is zero.
 * Arrays of structs step by the first one's `size`. Fields called reserved are 0.
 *
 * Trust. Packs are not trusted: whatever their bytes, neither CPU nor GPU reads or writes outside of what is theirs,
 * and a broken one is an error. Pointers, handles and Vulkan objects are trusted. Numbers are checked where their
 * comments give a range; BILLOW_ERROR_ARGUMENT names the field.
 *
 * Errors. Functions that can fail return a BillowResult and, where `error` is not NULL, fill it: code, what it is
 * about, and a line of text. There is no hidden state, neither in the library nor in threads. What fails later, on
 * billow's own threads, comes through billowTakeError(), each once. A function that fails has changed nothing.
 *
 * Threads. Functions of one context, and of what was created with it, are called by one thread at a time. Different
 * contexts share nothing. Exceptions: billowReadDone(), billowVersion(), billowResultName() and billowLookAt() may be
 * called by any thread at any time. Callbacks come from any thread, and must not call functions of a context.
 *
 * Memory. Vulkan's memory is never above BillowConfig::gpuBudget for frames, memoryBudget of each space, stagingBytes
 * for uploads, and less than 1 MiB for tables of draws. The system's for loads, staging and tables of packs is never
 * above cpuBudget; looks are fitted beside it (BillowOpenInfo::noLooks).
 *
 * Limits. A draw in a space shows up to 8 instances, as BillowSpaceInfo::maxVolumes says; any number may play.
 *
 * Units. Lengths are world units, times seconds, angles degrees, colours and radiances linear RGB, temperatures kelvin.
 * Transforms are row-major 3x4. For 64-bit machines. */
#ifndef BILLOW_BILLOW_H
#define BILLOW_BILLOW_H

#include <stddef.h>
#include <stdint.h>
#include <vulkan/vulkan_core.h>

#if defined(BILLOW_STATIC)
#define BILLOW_API
#elif defined(_WIN32) && defined(BILLOW_BUILDING)
#define BILLOW_API __declspec(dllexport)
#elif defined(_WIN32)
#define BILLOW_API __declspec(dllimport)
#else
#define BILLOW_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- version */

#define BILLOW_VERSION_MAJOR 0
#define BILLOW_VERSION_MINOR 1
#define BILLOW_VERSION_PATCH 0
#define BILLOW_MAKE_VERSION(major, minor, patch) ((uint32_t)(major) << 22 | (uint32_t)(minor) << 12 | (uint32_t)(patch))
#define BILLOW_VERSION BILLOW_MAKE_VERSION(BILLOW_VERSION_MAJOR, BILLOW_VERSION_MINOR, BILLOW_VERSION_PATCH)

/* BILLOW_VERSION of the library that runs. Hosts compiled with the same major version fit, older or newer. Any thread.
 */
BILLOW_API uint32_t billowVersion(void);

/* ---- results */

typedef enum BillowResult {
  BILLOW_OK = 0,
  BILLOW_NOT_READY = 1,          /* no error: nothing is there yet, nothing was done */
  BILLOW_ERROR_PACK = -1,        /* a pack breaks a rule of its format or cannot be read */
  BILLOW_ERROR_BUDGET = -2,      /* it does not fit into the budget; nothing was allocated */
  BILLOW_ERROR_UNSUPPORTED = -3, /* the device lacks something that billow needs */
  BILLOW_ERROR_VULKAN = -4,      /* a Vulkan call failed */
  BILLOW_ERROR_ARGUMENT = -5,    /* an argument is outside of what its comment allows */
  BILLOW_ERROR_MEMORY = -6,      /* the system's memory, not the GPU's, or another of its resources ran out */
  BILLOW_ERROR_DEVICE_LOST = -7, /* a Vulkan call failed with VK_ERROR_DEVICE_LOST; see billowDetach() */
  BILLOW_RESULT_MAX_ENUM = 0x7fffffff
} BillowResult;

/* "BILLOW_ERROR_PACK"; of other numbers "BILLOW_RESULT_UNKNOWN". Static text. Any thread. */
BILLOW_API const char* billowResultName(BillowResult result);

/* "none" among numbers of volumes, frames and pages. */
#define BILLOW_NONE 0xffffffffu

/* An open pack. 0: none. Names stay unequal after what they named is gone; then they are BILLOW_ERROR_ARGUMENT, or
 * nothing happens where a function has no result. */
typedef struct BillowPack {
  uint32_t id;
} BillowPack;

/* A volume of a pack that plays somewhere. 0: none. */
typedef struct BillowInstance {
  uint32_t id;
} BillowInstance;

typedef struct BillowError {
  uint32_t size;
  BillowResult code;
  BillowPack pack;   /* that it is about, or 0 */
  uint32_t volume;   /* of the pack, or BILLOW_NONE */
  uint32_t frame;    /* index into the volume's frames, or BILLOW_NONE */
  uint32_t page;     /* of the pack, or BILLOW_NONE */
  char message[488]; /* one line in UTF-8, cut where it is longer, ends with 0: what, where and why */
} BillowError;
#define BILLOW_ERROR_DEFAULT                                                      \
  {                                                                               \
    sizeof(BillowError), BILLOW_OK, {0}, BILLOW_NONE, BILLOW_NONE, BILLOW_NONE, { \
      0                                                                           \
    }                                                                             \
  }

/* ---- what the host lends */

/* All must outlive the context, or the time until billowDetach(). The device needs Vulkan 1.3 with these features
 * enabled: bufferDeviceAddress, timelineSemaphore, synchronization2. */
typedef struct BillowDevice {
  uint32_t size;
  uint32_t uploadFamily; /* queue family of uploadQueue */
  uint32_t drawFamily;   /* of the queues to which command buffers of billowDraw() are submitted: compute */
  uint32_t reserved;
  VkInstance instance;
  VkPhysicalDevice physicalDevice;
  VkDevice device;
  PFN_vkGetInstanceProcAddr getInstanceProcAddr;
  /* Transfer, graphics or compute. Used inside of billowUpdate() alone, where the host must use it on no other thread,
   * unless BillowConfig::submission says otherwise. A dedicated transfer queue is best: uploads run beside drawing. */
  VkQueue uploadQueue;
  /* What vkCreateDevice got: this struct with VkPhysicalDeviceVulkan12Features and ...13Features, or those of single
   * features, in its pNext chain, in any order; read by billowCreate() alone. What is missing is an error that names
   * it. textureCompressionBC makes frames smaller on the GPU. NULL: the three features are enabled and that one is not.
   */
  const VkPhysicalDeviceFeatures2* enabledFeatures;
  VkPipelineCache pipelineCache;                    /* optional: pipelines are looked up in it and added to it */
  const VkAllocationCallbacks* allocationCallbacks; /* optional: for all that billow creates; they may be called by
                                                     * several threads at once */
} BillowDevice;
#define BILLOW_DEVICE_DEFAULT \
  { sizeof(BillowDevice), 0, 0, 0, NULL, NULL, NULL, NULL, NULL, NULL, VK_NULL_HANDLE, NULL }

/* The host's job system: submit() has job(context) called once, on any thread but one that is inside of a function of
 * the context. Jobs take about a millisecond and never wait for another one. */
typedef struct BillowJobs {
  uint32_t size;
  uint32_t reserved;
  void (*submit)(void* user, void (*job)(void* context), void* context);
  void* user;
} BillowJobs;
#define BILLOW_JOBS_DEFAULT \
  { sizeof(BillowJobs), 0, NULL, NULL }

/* Memory for scratch, bytes of pages and bookkeeping of loads. From any thread. allocate() may return NULL: what it was
 * for then fails with BILLOW_ERROR_MEMORY. Both or none. */
typedef struct BillowAllocator {
  uint32_t size;
  uint32_t reserved;
  void* (*allocate)(void* user, size_t bytes, size_t alignment);
  void (*release)(void* user, void* memory, size_t bytes, size_t alignment);
  void* user;
} BillowAllocator;
#define BILLOW_ALLOCATOR_DEFAULT \
  { sizeof(BillowAllocator), 0, NULL, NULL, NULL }

typedef enum BillowLogLevel {
  BILLOW_LOG_DEBUG = 0,
  BILLOW_LOG_INFORMATION = 1,
  BILLOW_LOG_WARNING = 2,
  BILLOW_LOG_ERROR = 3,
  BILLOW_LOG_LEVEL_MAX_ENUM = 0x7fffffff
} BillowLogLevel;

/* Gets lines without a line break, from any thread, valid until it returns. */
typedef struct BillowLog {
  uint32_t size;
  uint32_t reserved;
  void (*write)(void* user, BillowLogLevel level, const char* line);
  void* user;
} BillowLog;
#define BILLOW_LOG_DEFAULT \
  { sizeof(BillowLog), 0, NULL, NULL }

/* Whether the checksum of a page is compared when it is read. Indices and counts in it are checked whatever this says.
 */
typedef enum BillowVerify {
  BILLOW_VERIFY_ALWAYS = 0,
  BILLOW_VERIFY_ONCE = 1, /* the first time that a pack's page is read */
  BILLOW_VERIFY_NEVER = 2,
  BILLOW_VERIFY_MAX_ENUM = 0x7fffffff
} BillowVerify;

/* Who submits to BillowDevice::uploadQueue. */
typedef enum BillowSubmission {
  BILLOW_SUBMIT_IN_UPDATE = 0, /* billowUpdate(): the queue may be the one that the host draws with */
  BILLOW_SUBMIT_OWN = 1,       /* billow's threads, as soon as there is something: the queue is billow's alone */
  BILLOW_SUBMISSION_MAX_ENUM = 0x7fffffff
} BillowSubmission;

typedef enum BillowBlocks {
  BILLOW_BLOCKS_AUTOMATIC = 0, /* BC7 where the device samples it fast in 3D images */
  BILLOW_BLOCKS_NATIVE = 1,    /* wherever it samples it */
  BILLOW_BLOCKS_DECODED = 2,   /* never: 8 bits a voxel */
  BILLOW_BLOCKS_MAX_ENUM = 0x7fffffff
} BillowBlocks;

typedef struct BillowConfig {
  uint32_t size;
  /* Commands recorded after a billowUpdate() have been executed before the one that is so many later: 1 where the host
   * waits for each frame, 2 or 3 as usual. At least 1. Memory of frames that gave way is reused only after so many. */
  uint32_t framesInFlight;
  uint64_t gpuBudget;    /* bytes of device memory of resident frames; never exceeded */
  uint64_t cpuBudget;    /* bytes for staging, reads in flight, scratch, tables of open packs; never exceeded */
  uint64_t stagingBytes; /* of the upload ring, a part of cpuBudget, at least 64 KiB */
  /* Billow's threads: these, of which 0 may be, and then `jobs` does all of it; readThreads; one that plans, which
   * sleeps but for some tens of microseconds an update; with BILLOW_SUBMIT_OWN one that submits; one that fits looks,
   * from the first billowOpenLater() or billowReload() that wants them. */
  uint32_t threads;       /* that decompress */
  uint32_t readThreads;   /* that read files; 0: packs come from a BillowFile alone */
  double prefetchSeconds; /* how far ahead of what is shown is loaded, real time, 0 to 60 */
  BillowVerify verify;
  BillowSubmission submission;
  BillowBlocks blocks;
  uint32_t directDraws;   /* billowDraw() calls without a space in framesInFlight frames together, at least 1 */
  const BillowJobs* jobs; /* optional; required where threads is 0. These three are copied. */
  const BillowAllocator* allocator; /* optional: else the C++ heap */
  const BillowLog* log;             /* optional: else nothing is logged */
} BillowConfig;
#define BILLOW_CONFIG_DEFAULT                                                                        \
  {                                                                                                  \
    sizeof(BillowConfig), 3, (uint64_t)256 << 20, (uint64_t)64 << 20, (uint64_t)8 << 20, 2, 1, 0.25, \
        BILLOW_VERIFY_ONCE, BILLOW_SUBMIT_IN_UPDATE, BILLOW_BLOCKS_AUTOMATIC, 3, NULL, NULL, NULL    \
  }

/* ---- context */

typedef struct BillowContext BillowContext;

/* Creates a context on the host's device, and billow's threads.
 * BILLOW_ERROR_UNSUPPORTED: the device lacks features, a function or Vulkan 1.3; the message names what is missing.
 * BILLOW_ERROR_ARGUMENT: a handle is missing or a number out of its range. Others: BUDGET, VULKAN, MEMORY.
 * *context is set on success alone. Any thread. */
BILLOW_API BillowResult billowCreate(const BillowDevice* device, const BillowConfig* config, BillowContext** context,
                                     BillowError* error);

/* Ends everything: waits for billow's threads, the uploads and the host's reads in flight. Spaces and compositors must
 * be destroyed before, and no commands that draw may be pending. NULL: nothing happens. */
BILLOW_API void billowDestroy(BillowContext* context);

/* Changes the budgets, both in bytes. Smaller ones take effect as soon as the frames in flight allow; what is drawn
 * becomes coarser where it must. BILLOW_ERROR_ARGUMENT: gpuBytes is 0, or cpuBytes less than stagingBytes. */
BILLOW_API BillowResult billowSetBudget(BillowContext* context, uint64_t gpuBytes, uint64_t cpuBytes,
                                        BillowError* error);

/* After the device was lost, or before the host replaces it: gives back everything on it, and forgets what was
 * resident. Packs, instances and spaces stay. It waits for packs that open, loads and uploads that are under way, and
 * so for the host's reads of them. Until billowAttach() updates advance time alone and nothing is drawable:
 * billowDraw(), billowCreateSpace() and the like are BILLOW_NOT_READY. No commands that draw may be pending, unless the
 * device is lost. */
BILLOW_API void billowDetach(BillowContext* context);

/* Goes on with another device, which may lack and have other things. Errors as billowCreate(); the context is then
 * still detached. */
BILLOW_API BillowResult billowAttach(BillowContext* context, const BillowDevice* device, BillowError* error);

/* ---- packs */

/* A read of the host's that is in flight. */
typedef struct BillowRead {
  void (*call)(void); /* billow's own, as is context */
  void* context;
} BillowRead;

/* The read has ended. `into` holds all bytes where `success` is not 0; else loads that need them fail with
 * BILLOW_ERROR_PACK. Once for each BillowFile::read. Any thread, even from inside of read(). */
BILLOW_API void billowReadDone(BillowRead read, uint32_t success);

/* The host's own files: in archives, on a network. */
typedef struct BillowFile {
  uint32_t size;
  uint32_t reserved;
  uint64_t bytes; /* the pack's length */
  /* Begins to fill `into` with `count` bytes at `offset`, which lie within the pack, and returns without waiting.
   * `into` stays until billowReadDone(). Called by several threads at once. Bytes are not trusted. */
  void (*read)(void* user, uint64_t offset, void* into, size_t count, BillowRead done);
  /* Optional: no further read() comes, all reads have ended. Once, from any thread, if billowOpen(), billowOpenLater()
   * or billowReload() was BILLOW_OK: when the pack was closed, replaced or could not be opened after all, at the latest
   * in billowDestroy(). Where they fail the file stays the host's, nothing reads it any more, and close() does not
   * come. */
  void (*close)(void* user);
  void* user;
} BillowFile;
#define BILLOW_FILE_DEFAULT \
  { sizeof(BillowFile), 0, 0, NULL, NULL, NULL }

/* One of path and file. */
typedef struct BillowOpenInfo {
  uint32_t size;
  /* 1: no look is fitted: instances have the host's, or what the pack says beside BILLOW_LOOK_DEFAULT. Fitting takes
   * memory of one frame and of the pack's tables beside cpuBudget and BillowAllocator: billowOpen() on the calling
   * thread, billowOpenLater() and billowReload() one pack after the other on one thread, which the first of them
   * starts. */
  uint32_t noLooks;
  const char* path;       /* in the system's encoding; the file stays open and must not be written to, only replaced */
  const BillowFile* file; /* copied */
} BillowOpenInfo;
#define BILLOW_OPEN_INFO_DEFAULT \
  { sizeof(BillowOpenInfo), 0, NULL, NULL }

/* Opens a pack on the calling thread: reads and checks its tables, and fits a look to each volume, which reads and
 * decompresses one frame of it (as BillowOpenInfo::noLooks does not). For loading screens: it takes as long as the
 * disk. With a BillowFile it waits for reads, which another thread must end. BILLOW_ERROR_PACK: it is no sound pack, or
 * cannot be read. BILLOW_ERROR_BUDGET: its tables do not fit into cpuBudget. */
BILLOW_API BillowResult billowOpen(BillowContext* context, const BillowOpenInfo* info, BillowPack* pack,
                                   BillowError* error);

/* The same on billow's threads: returns at once, and billowPackState() tells. A failure comes through
 * billowTakeError(). Instances may be added before it is ready; they are drawn from then on: plainly, as with
 * BillowOpenInfo::noLooks, until their look is fitted. */
BILLOW_API BillowResult billowOpenLater(BillowContext* context, const BillowOpenInfo* info, BillowPack* pack,
                                        BillowError* error);

typedef enum BillowPackState {
  BILLOW_PACK_UNKNOWN = 0, /* closed, or never was */
  BILLOW_PACK_OPENING = 1,
  BILLOW_PACK_READY = 2,
  BILLOW_PACK_FAILED = 3, /* could not be opened; to be closed, or reloaded */
  BILLOW_PACK_STATE_MAX_ENUM = 0x7fffffff
} BillowPackState;

BILLOW_API BillowPackState billowPackState(BillowContext* context, BillowPack pack);

/* Opens `info` beside the pack, on billow's threads. Once it is open and what is shown now is resident of it, it takes
 * the pack's place, without a stall; instances keep their time. Looks are fitted anew, given ones stay. Effects in
 * spaces stay those of the pack with which the space was created. A source that fails leaves all as it was, and comes
 * through billowTakeError(). */
BILLOW_API BillowResult billowReload(BillowContext* context, BillowPack pack, const BillowOpenInfo* info,
                                     BillowError* error);

/* Its instances go too. Commands that draw it may still be pending. */
BILLOW_API void billowClose(BillowContext* context, BillowPack pack);

typedef struct BillowPackInfo {
  uint32_t size;
  uint32_t volumes; /* that can be played: levels of detail are no volumes of their own */
  uint32_t effects;
  uint32_t reserved;
} BillowPackInfo;
#define BILLOW_PACK_INFO_DEFAULT \
  { sizeof(BillowPackInfo), 0, 0, 0 }

/* BILLOW_NOT_READY while the pack opens. */
BILLOW_API BillowResult billowPackInfo(const BillowContext* context, BillowPack pack, BillowPackInfo* info,
                                       BillowError* error);

typedef struct BillowVolumeInfo {
  uint32_t size;
  uint32_t frames;
  double seconds; /* from the first frame's begin to the last one's end */
  double framesPerSecond;
  double min[3],
      max[3];        /* the box, in the volume's own world, of all that is active in any frame; both 0: nothing is */
  double voxelSize;  /* the smallest edge of its voxels, in the volume's own world; 0: it has none */
  uint32_t velocity; /* 1: it can be advected */
  uint32_t burning;  /* 1: it has temperature or flames */
  char name[256];    /* UTF-8, ends with 0, cut where it is longer */
} BillowVolumeInfo;
#define BILLOW_VOLUME_INFO_DEFAULT                                      \
  {                                                                     \
    sizeof(BillowVolumeInfo), 0, 0, 0, {0, 0, 0}, {0, 0, 0}, 0, 0, 0, { \
      0                                                                 \
    }                                                                   \
  }

/* `volume` counts from 0. BILLOW_NOT_READY while the pack opens. */
BILLOW_API BillowResult billowVolumeInfo(const BillowContext* context, BillowPack pack, uint32_t volume,
                                         BillowVolumeInfo* info, BillowError* error);

typedef struct BillowEffectInfo {
  uint32_t size;
  uint32_t loop;         /* 1: it begins again */
  double seconds;        /* for which its emitters run; particles may live on */
  double min[3], max[3]; /* the box, in the effect's own world, of its particles at sixteen moments of its time */
  char name[256];
} BillowEffectInfo;
#define BILLOW_EFFECT_INFO_DEFAULT                          \
  {                                                         \
    sizeof(BillowEffectInfo), 0, 0, {0, 0, 0}, {0, 0, 0}, { \
      0                                                     \
    }                                                       \
  }

/* Evaluates the effect, which takes milliseconds. BILLOW_NOT_READY while the pack opens. */
BILLOW_API BillowResult billowEffectInfo(const BillowContext* context, BillowPack pack, uint32_t effect,
                                         BillowEffectInfo* info, BillowError* error);

/* ---- looks */

/* How grid values become light. */
typedef struct BillowLook {
  uint32_t size;
  float extinctionScale;     /* extinction a world unit of a density of 1 */
  float albedo[3];           /* in [0, 1] */
  float anisotropy;          /* of Henyey and Greenstein, in (-1, 1) */
  float emissionScale;       /* 0: no emission */
  float temperatureScale;    /* kelvin a grid value */
  float temperatureOffset;   /* kelvin */
  float referenceKelvin;     /* black body of radiance emissionScale, > 0 */
  float ambient[3];          /* radiance from all around, finite */
  uint32_t scatteringOrders; /* 1: single scattering; more imitate multiple scattering; 1 to 8 */
  /* Smoke derived from temperature (or flames) where there is no density: shares of heatMax at which smoke begins and
   * is full, and what is left of it at heatMax. */
  float heatMax; /* largest temperature (or flames) value, > 0 */
  float smokeBegin;
  float smokeFull;
  float smokeInFire;
} BillowLook;
#define BILLOW_LOOK_DEFAULT \
  { sizeof(BillowLook), 1, {0.9f, 0.9f, 0.9f}, 0.5f, 1, 1000, 300, 1600, {0.3f, 0.35f, 0.4f}, 1, 1, 0.02f, 0.3f, 0.25f }

/* The look that fits a volume: what its pack says, and for the rest values measured from its data. Instances without a
 * look of their own are drawn so. BILLOW_NOT_READY while the pack opens and the look is measured. */
BILLOW_API BillowResult billowSuggestLook(const BillowContext* context, BillowPack pack, uint32_t volume,
                                          BillowLook* look, BillowError* error);

/* ---- instances */

typedef enum BillowLoop {
  BILLOW_LOOP_ONCE = 0, /* the first and last frames are held */
  BILLOW_LOOP_LOOP = 1,
  BILLOW_LOOP_PING_PONG = 2,
  BILLOW_LOOP_MAX_ENUM = 0x7fffffff
} BillowLoop;

typedef enum BillowInterpolation {
  BILLOW_INTERPOLATION_HOLD = 0,   /* the frame that began last */
  BILLOW_INTERPOLATION_BLEND = 1,  /* two frames, weighted */
  BILLOW_INTERPOLATION_ADVECT = 2, /* both carried along their velocity, then weighted; blend where there is none */
  BILLOW_INTERPOLATION_MAX_ENUM = 0x7fffffff
} BillowInterpolation;

typedef struct BillowPlayback {
  uint32_t size;
  BillowLoop loop;
  BillowInterpolation interpolation;
  uint32_t reserved;
  double speed; /* volume seconds a real second, finite; negative: backwards; 0: stands */
} BillowPlayback;
#define BILLOW_PLAYBACK_DEFAULT \
  { sizeof(BillowPlayback), BILLOW_LOOP_LOOP, BILLOW_INTERPOLATION_BLEND, 0, 1 }

typedef struct BillowInstanceInfo {
  uint32_t size;
  BillowPack pack;
  uint32_t volume; /* counts from 0 */
  float priority;  /* multiplies its size in the picture when billow chooses what to load, >= 0; 0: nothing is loaded */
  double time;     /* seconds from the volume's first frame, finite */
  double objectToWorld[12];       /* from the volume's own world, invertible */
  const BillowPlayback* playback; /* optional: BILLOW_PLAYBACK_DEFAULT */
  const BillowLook* look;         /* optional: billowSuggestLook() */
} BillowInstanceInfo;
#define BILLOW_INSTANCE_INFO_DEFAULT \
  { sizeof(BillowInstanceInfo), {0}, 0, 1, 0, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, NULL, NULL }

/* Any number of instances of one volume share what is resident of it. Its pack may still be opening. */
BILLOW_API BillowResult billowAddInstance(BillowContext* context, const BillowInstanceInfo* info,
                                          BillowInstance* instance, BillowError* error);

/* Commands that draw it may still be pending. */
BILLOW_API void billowRemoveInstance(BillowContext* context, BillowInstance instance);

/* From the next update on. BILLOW_ERROR_ARGUMENT where there is no such instance or a number is out of its range. */
BILLOW_API BillowResult billowSetPlayback(BillowContext* context, BillowInstance instance,
                                          const BillowPlayback* playback, BillowError* error);
BILLOW_API BillowResult billowSetTransform(BillowContext* context, BillowInstance instance,
                                           const double objectToWorld[12], BillowError* error);
BILLOW_API BillowResult billowSetPriority(BillowContext* context, BillowInstance instance, float priority,
                                          BillowError* error);
BILLOW_API BillowResult billowSeek(BillowContext* context, BillowInstance instance, double time, BillowError* error);
/* From the next draw on. NULL: the suggested one again. */
BILLOW_API BillowResult billowSetLook(BillowContext* context, BillowInstance instance, const BillowLook* look,
                                      BillowError* error);

typedef struct BillowInstanceState {
  uint32_t size;
  uint32_t drawable; /* 0 only before anything of the volume was resident */
  uint32_t held;     /* 1: nothing of the wanted moment was resident, the last one that was is shown */
  uint32_t coarse;   /* 1: some of it is coarser than the picture's size asks for */
  double time;       /* seconds of the volume that are shown */
} BillowInstanceState;
#define BILLOW_INSTANCE_STATE_DEFAULT \
  { sizeof(BillowInstanceState), 0, 0, 0, 0 }

/* As of the last update. */
BILLOW_API BillowResult billowInstanceState(const BillowContext* context, BillowInstance instance,
                                            BillowInstanceState* state, BillowError* error);

/* ---- update */

/* A pinhole camera. `right`, `up` and `forward` are orthonormal. */
typedef struct BillowView {
  uint32_t size;
  float tanHalfHeight; /* tangent of half the vertical field of view, > 0 */
  double eye[3];
  float right[3];
  float up[3];
  float forward[3];
  uint32_t reserved;
} BillowView;
#define BILLOW_VIEW_DEFAULT \
  { sizeof(BillowView), 0.4f, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, -1}, 0 }

/* Fills *view, whose `size` is set: from `eye` at `target`, fieldOfView vertical, in (0, 180) degrees. Where `up` is
 * parallel to the direction another axis is taken. Any thread. */
BILLOW_API void billowLookAt(const double eye[3], const double target[3], const double up[3], float fieldOfView,
                             BillowView* view);

typedef struct BillowUpdateInfo {
  uint32_t size;
  uint32_t pixelsHigh;    /* of the picture: with the view, how fine each instance must be; at least 1 */
  double seconds;         /* that passed since the update before, >= 0, finite */
  const BillowView* view; /* optional: without one all instances are near */
} BillowUpdateInfo;
#define BILLOW_UPDATE_INFO_DEFAULT \
  { sizeof(BillowUpdateInfo), 1080, 0, NULL }

/* Advances every instance, takes in what has arrived, asks for what is needed next, and says what draws will show. Once
 * a frame. Never waits, neither for a disk nor for the device; tens of microseconds. */
BILLOW_API BillowResult billowUpdate(BillowContext* context, const BillowUpdateInfo* info, BillowError* error);

/* What the submission that draws must wait for, on the device, at VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT. What signals
 * it has been submitted, and mostly executed; what was urgent is drawn by the update that submits it. semaphore is
 * VK_NULL_HANDLE while detached. */
typedef struct BillowWait {
  uint32_t size;
  uint32_t reserved;
  VkSemaphore semaphore; /* a timeline semaphore, billow's */
  uint64_t value;
} BillowWait;
#define BILLOW_WAIT_DEFAULT \
  { sizeof(BillowWait), 0, VK_NULL_HANDLE, 0 }

/* After billowUpdate(), for all draws until the next one. */
BILLOW_API void billowUpdateWait(const BillowContext* context, BillowWait* wait);

/* Why bricks of the wanted moments are not shown in the detail that the picture asks for. */
typedef enum BillowMissing {
  BILLOW_MISSING_QUEUED = 0,
  BILLOW_MISSING_READING = 1,
  BILLOW_MISSING_DECODING = 2,
  BILLOW_MISSING_UPLOADING = 3,
  BILLOW_MISSING_GPU_BUDGET = 4,
  BILLOW_MISSING_CPU_BUDGET = 5,
  BILLOW_MISSING_FAILED = 6,
  BILLOW_MISSING_MAX_ENUM = 0x7fffffff
} BillowMissing;

typedef struct BillowStats {
  uint32_t size;
  uint32_t instances; /* of those with a priority above 0 */
  uint64_t updates;
  /* Since the update before. */
  uint64_t bytesRead, bytesDecompressed, bytesUploaded, bytesEvicted;
  uint32_t framesLoaded, framesEvicted;
  uint32_t framesLate; /* began, for an instance with a priority above 0, when nothing of their moment could be drawn */
  uint32_t reserved;
  /* Now. */
  uint64_t gpuBytes;      /* of resident and arriving frames */
  uint64_t gpuAllocated;  /* device memory held for frames, never above gpuBudget */
  uint64_t gpuPeak;       /* the most that ever was */
  uint64_t gpuBytesInAll; /* all memory that billow has from Vulkan: frames, spaces, tables, staging */
  uint64_t cpuBytes;      /* never above cpuBudget */
  uint64_t cpuPeak;
  uint32_t framesResident;
  uint32_t loadsQueued, loadsReading, loadsDecoding, loadsUploading;
  uint32_t instancesHeld, instancesCoarse, instancesEmpty; /* as BillowInstanceState; empty: not drawable */
  uint64_t missingBricks[7];                               /* by BillowMissing */
} BillowStats;
#define BILLOW_STATS_DEFAULT                                                                       \
  {                                                                                                \
    sizeof(BillowStats), 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, { \
      0, 0, 0, 0, 0, 0, 0                                                                          \
    }                                                                                              \
  }

/* As of the last update. */
BILLOW_API void billowStats(const BillowContext* context, BillowStats* stats);

/* Takes the oldest error of billow's threads: a broken page, a failed read, a pack that could not be opened. Each comes
 * once; all else keeps playing. BILLOW_OK: one was taken, error->code and the rest tell of it. BILLOW_NOT_READY: there
 * is none. While 256 wait to be taken further ones are logged alone. */
BILLOW_API BillowResult billowTakeError(BillowContext* context, BillowError* error);

/* ---- draw */

typedef struct BillowSun {
  uint32_t size;
  float direction[3];  /* to the sun, any length but 0 */
  float irradiance[3]; /* at normal incidence, >= 0 */
} BillowSun;
#define BILLOW_SUN_DEFAULT                    \
  {                                           \
    sizeof(BillowSun), {-0.4f, 0.8f, 0.4f}, { \
      8, 8, 8                                 \
    }                                         \
  }

typedef enum BillowFilter {
  BILLOW_FILTER_NEAREST = 0,
  BILLOW_FILTER_TRILINEAR = 1,
  BILLOW_FILTER_NONE = 2, /* of shadows: there are none */
  BILLOW_FILTER_MAX_ENUM = 0x7fffffff
} BillowFilter;

typedef struct BillowQuality {
  uint32_t size;
  float step;      /* of the march in voxels, >= 0.05 */
  uint32_t jitter; /* 1: each pixel's steps are displaced by a fixed pattern: noise in place of bands */
  /* Draws without a space alone. */
  BillowFilter filter;
  BillowFilter shadows;
  float shadowStep;     /* voxels, >= 0.05 */
  uint32_t shadowSteps; /* at most, a sample; longer ways take longer steps; at least 1 */
} BillowQuality;
#define BILLOW_QUALITY_DEFAULT \
  { sizeof(BillowQuality), 1, 0, BILLOW_FILTER_TRILINEAR, BILLOW_FILTER_TRILINEAR, 2, 64 }

typedef struct BillowBackground {
  uint32_t size;
  float bottom[3]; /* radiance, finite */
  float top[3];
  float opacity; /* in [0, 1]; 0: the picture is premultiplied, its alpha that of the volumes; 1: this fills it */
} BillowBackground;
#define BILLOW_BACKGROUND_DEFAULT \
  { sizeof(BillowBackground), {0, 0, 0}, {0, 0, 0}, 0 }

typedef enum BillowColorFormat {
  BILLOW_COLOR_RGBA16F = 0, /* VK_FORMAT_R16G16B16A16_SFLOAT */
  BILLOW_COLOR_RGBA32F = 1, /* VK_FORMAT_R32G32B32A32_SFLOAT */
  BILLOW_COLOR_FORMAT_MAX_ENUM = 0x7fffffff
} BillowColorFormat;

/* Metavoxels: a light-aligned space in which volumes and particles shadow, occlude and light each other. A space and
 * its memory serve one picture a frame. Without one a draw marches the tree of a single volume instead. */
typedef struct BillowSpace BillowSpace;

typedef struct BillowSpaceInfo {
  uint32_t size;
  uint32_t edge;          /* voxels along a metavoxel's edge, its border of one included; 4 to 64 */
  uint32_t metavoxels;    /* along each axis of the space, 1 to 128; metavoxels * (edge - 2) <= 4096 */
  uint32_t maxMetavoxels; /* occupied ones of a draw, 1 to 65535; further ones are left out */
  uint64_t memoryBudget; /* device bytes of the space. Too little for all its metavoxels: they are drawn in rounds, with
                          * the same picture. Far too little is BILLOW_ERROR_BUDGET. */
  uint32_t maxParticles; /* of a draw, to 1 048 576: as many as all its effects may have alive */
  uint32_t maxListEntries; /* particles in metavoxels' lists, all together; further ones are left out */
  uint32_t maxVolumes;     /* instances of a draw, 0 to 8 */
  uint32_t lightField;     /* voxels along each axis of the field that lets matter light matter (BillowScattering):
                            * `metavoxels` to 160, or 0, none */
  uint32_t drawsInFlight;  /* billowDraw() calls with this space whose commands may be pending at once, at least 1 */
  uint32_t keepFilled;     /* 1: metavoxels stay filled from draw to draw, for BillowDrawInfo::refill */
  uint32_t packCount;
  uint32_t reserved;
  const BillowPack* packs; /* whose effects can be drawn in the space; all are ready. Their effects are copied. */
} BillowSpaceInfo;
#define BILLOW_SPACE_INFO_DEFAULT \
  { sizeof(BillowSpaceInfo), 32, 32, 4096, (uint64_t)512 << 20, 16384, 1u << 20, 4, 0, 3, 0, 0, 0, NULL }

/* Allocates all of the space's memory. Errors: ARGUMENT, BUDGET, VULKAN, MEMORY; BILLOW_NOT_READY: a pack still opens,
 * or the context is detached. *space is set on success alone. */
BILLOW_API BillowResult billowCreateSpace(BillowContext* context, const BillowSpaceInfo* info, BillowSpace** space,
                                          BillowError* error);
/* No commands that draw with it may be pending. NULL: nothing happens. */
BILLOW_API void billowDestroySpace(BillowSpace* space);

/* An effect of a pack of the space. */
typedef struct BillowEffect {
  uint32_t size;
  BillowPack pack;
  uint32_t effect; /* counts from 0 */
  uint32_t reserved;
  double time;              /* seconds since its begin, finite; before it the effect is not there */
  double objectToWorld[12]; /* from the effect's own world: it turns, moves and scales alike in all directions, by 1e-6
                             * to 1e6 */
} BillowEffect;
#define BILLOW_EFFECT_DEFAULT             \
  {                                       \
    sizeof(BillowEffect), {0}, 0, 0, 0, { \
      1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0  \
    }                                     \
  }

/* How all matter of a space scatters. */
typedef struct BillowScattering {
  uint32_t size;
  float anisotropy;   /* in (-1, 1) */
  float ambient[3];   /* finite */
  uint32_t orders;    /* as BillowLook::scatteringOrders, 1 to 8 */
  float surroundings; /* with a light field: how much of the light that other matter emits and scatters counts, in
                       * [0, 1]; 0 costs nothing */
  uint32_t bounces;   /* how often that light is scattered, 1 to 8 */
} BillowScattering;
#define BILLOW_SCATTERING_DEFAULT \
  { sizeof(BillowScattering), 0.5f, {0.3f, 0.35f, 0.4f}, 1, 1, 2 }

/* Where the scene's opaque surfaces begin on the sunlight's way. Voxels behind them get no sun; outside of the map
 * nothing is shadowed. */
typedef struct BillowShadowMap {
  uint32_t size;
  VkImageLayout layout;
  VkImageView view;      /* sampled 2D image, R32F or depth, readable by the compute shader stage */
  double worldToMap[12]; /* from the world to texels x and y (whole numbers and a half at their centres), which must not
                          * change along the light, and to what a surface there has written, which must */
  float empty;           /* of texels without a surface; what is not finite is one too */
  uint32_t reserved;
} BillowShadowMap;
#define BILLOW_SHADOW_MAP_DEFAULT \
  { sizeof(BillowShadowMap), VK_IMAGE_LAYOUT_GENERAL, VK_NULL_HANDLE, {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, 1, 0 }

typedef enum BillowAttenuation {
  BILLOW_ATTENUATION_EXPONENTIAL = 0, /* exp(-d) of sunlight is left behind a voxel of optical depth d */
  BILLOW_ATTENUATION_RECIPROCAL = 1,  /* 1 / (1 + d) */
  BILLOW_ATTENUATION_MAX_ENUM = 0x7fffffff
} BillowAttenuation;

typedef enum BillowBlend {
  BILLOW_BLEND_MAXIMUM = 0,  /* of diffuse colours that meet in a voxel the largest of each channel */
  BILLOW_BLEND_WEIGHTED = 1, /* their mean, weighted by extinction */
  BILLOW_BLEND_MAX_ENUM = 0x7fffffff
} BillowBlend;

typedef enum BillowRefill {
  BILLOW_REFILL_ALWAYS = 0,
  BILLOW_REFILL_CHANGED = 1, /* metavoxels whose content has changed, as the GPU finds */
  BILLOW_REFILL_NEVER = 2,   /* those that are new; what else has changed is not seen */
  BILLOW_REFILL_MAX_ENUM = 0x7fffffff
} BillowRefill;

typedef struct BillowDrawInfo {
  uint32_t size;
  BillowColorFormat colorFormat;
  BillowSpace* space; /* NULL: direct, for a single instance that is turned and moved but not scaled */
  const BillowView* view;
  const BillowSun* sun; /* optional, as all that follow: their defaults */
  const BillowQuality* quality;
  const BillowBackground* background;
  /* NULL: all of the context; where more than BillowSpaceInfo::maxVolumes are drawable, those that are largest in the
   * picture, times their priority. Those that are not drawable yet are left out. */
  const BillowInstance* instances;
  uint32_t instanceCount;
  uint32_t width, height; /* of all images; the first two are in VK_IMAGE_LAYOUT_GENERAL */
  uint32_t reserved;
  VkImageView color; /* storage image, is written: premultiplied linear RGBA */
  VkImageView depth; /* storage image R32F, is written: distance along `forward`, weighted by opacity; infinity where
                      * nothing is */
  /* All that follows is for draws with a space. */
  VkImageView sceneDepth; /* storage image R32F in VK_IMAGE_LAYOUT_GENERAL: distance of the scene along `forward` */
  const BillowShadowMap* shadowMap;
  const BillowScattering* scattering; /* NULL: that of the first instance's look */
  const BillowEffect* effects;
  uint32_t effectCount;
  float voxelSize;  /* world units, > 0; 0: the space lies around what is drawn, of its finest voxels or larger */
  double center[3]; /* of the space, where voxelSize is not 0 */
  double
      anchor[3]; /* voxels' centres lie at whole multiples of voxelSize from it, so that a moving space doesn't swim */
  BillowAttenuation attenuation;
  BillowBlend blend;
  BillowRefill refill;      /* which metavoxels are filled anew; all, where BillowSpaceInfo::keepFilled is 0 */
  uint32_t noCull;          /* 1: what neither the eye sees nor light passes on its way to it is drawn too */
  float lightExtinction[3]; /* what red, green and blue sunlight lose, as multiples of the extinction, >= 0 */
  uint32_t firstTimestamp;
  VkQueryPool timestamps; /* optional: 6 timestamps from firstTimestamp, reset by the host: begin, binned, first round
                           * filled, lit and marched, end */
} BillowDrawInfo;
#define BILLOW_DRAW_INFO_DEFAULT                                                                                      \
  {                                                                                                                   \
    sizeof(BillowDrawInfo), BILLOW_COLOR_RGBA16F, NULL, NULL, NULL, NULL, NULL, NULL, 0, 0, 0, 0, VK_NULL_HANDLE,     \
        VK_NULL_HANDLE, VK_NULL_HANDLE, NULL, NULL, NULL, 0, 0, {0, 0, 0}, {0, 0, 0}, BILLOW_ATTENUATION_EXPONENTIAL, \
        BILLOW_BLEND_MAXIMUM, BILLOW_REFILL_ALWAYS, 0, {1, 1, 1}, 0, VK_NULL_HANDLE                                   \
  }

/* Records what draws the instances as of the last update, for a queue of the draw family with compute (and transfers,
 * with a space); the submission waits for billowUpdateWait(). Every pixel of both images is written. Pipelines that
 * were not met before are built here, unless billowPrepare() has. Draws of one space follow each other on one queue.
 * barriers: both images free of pending access before; afterwards they were read and written by the compute shader
 * stage. BILLOW_NOT_READY: nothing was recorded, the images are as they were: detached, or without a space and the
 * instance is not drawable yet. BILLOW_ERROR_ARGUMENT: more given instances than maxVolumes, an effect of another pack,
 * numbers out of range. */
BILLOW_API BillowResult billowDraw(BillowContext* context, VkCommandBuffer commands, const BillowDrawInfo* draw,
                                   BillowError* error);

/* Builds the pipelines that draws of this volume without a space need; for loading screens, it may take seconds.
 * quality: optional. BILLOW_NOT_READY while the pack opens. */
BILLOW_API BillowResult billowPrepare(BillowContext* context, BillowPack pack, uint32_t volume,
                                      const BillowQuality* quality, BillowColorFormat colorFormat, BillowError* error);

typedef struct BillowSpaceStats {
  uint32_t size;
  /* Of the last draw whose commands have been executed; all 0 before. */
  uint32_t draw;        /* counts from 1 */
  uint32_t occupied;    /* metavoxels in which something is, whether or not they were drawn */
  uint32_t drawn;       /* at most maxMetavoxels */
  uint32_t filled;      /* of those drawn */
  uint32_t listEntries; /* particles in lists, whether or not there was room */
  uint32_t poolSlots;   /* metavoxels that are resident at once */
  uint32_t reserved;
  uint64_t bytes; /* device memory of the space, never above memoryBudget */
} BillowSpaceStats;
#define BILLOW_SPACE_STATS_DEFAULT \
  { sizeof(BillowSpaceStats), 0, 0, 0, 0, 0, 0, 0, 0 }

BILLOW_API void billowSpaceStats(const BillowSpace* space, BillowSpaceStats* stats);

/* The shadow that a space casts on the scene. */
typedef struct BillowSpaceShadow {
  uint32_t size;
  uint32_t texels; /* along both edges; 0 while detached */
  VkImage image;
  VkImageView view;  /* R32F in VK_IMAGE_LAYOUT_GENERAL: optical depth up to the scene's first surface; each draw writes
                      * it  anew */
  double toTexel[8]; /* of the draw recorded last, a row each for x and y: texel = dot(row, (world, 1)), whole numbers
                      * and a half at their centres */
} BillowSpaceShadow;
#define BILLOW_SPACE_SHADOW_DEFAULT                                 \
  {                                                                 \
    sizeof(BillowSpaceShadow), 0, VK_NULL_HANDLE, VK_NULL_HANDLE, { \
      0, 0, 0, 0, 0, 0, 0, 0                                        \
    }                                                               \
  }

BILLOW_API void billowSpaceShadow(const BillowSpace* space, BillowSpaceShadow* shadow);

/* ---- composite */

/* Lays a picture of billowDraw(), of the game's resolution or a lower one, over the game's image, without cracks where
 * a coarse pixel has one surface and a fine one another. */
typedef struct BillowCompositor BillowCompositor;

/* drawsInFlight: billowComposite() calls whose commands may be pending at once, at least 1. *compositor is set on
 * success alone. BILLOW_NOT_READY while detached. */
BILLOW_API BillowResult billowCreateCompositor(BillowContext* context, uint32_t drawsInFlight,
                                               BillowCompositor** compositor, BillowError* error);
/* No commands that it recorded may be pending. NULL: nothing happens. */
BILLOW_API void billowDestroyCompositor(BillowCompositor* compositor);

/* All images are storage images in VK_IMAGE_LAYOUT_GENERAL; all depths are R32F, distances along `forward`, infinity or
 * any large number where nothing is. */
typedef struct BillowCompositeInfo {
  uint32_t size;
  BillowColorFormat colorFormat;
  uint32_t width, height; /* of color, depth and sceneDepth: the picture */
  VkImageView color;      /* as billowDraw() wrote them, with a background of opacity 0 */
  VkImageView depth;
  VkImageView sceneDepth; /* that the picture was marched to; best not a mean of the finer one but one of its values.
                           * Optional: without it a texel is hidden where its depth lies behind targetDepth. */
  VkImageView target;     /* linear, premultiplied where its alpha counts; the picture is laid over it */
  VkImageView targetDepth;
  uint32_t targetWidth, targetHeight;
  BillowColorFormat targetFormat;
  uint32_t reserved;
} BillowCompositeInfo;
#define BILLOW_COMPOSITE_INFO_DEFAULT                                                                        \
  {                                                                                                          \
    sizeof(BillowCompositeInfo), BILLOW_COLOR_RGBA16F, 0, 0, VK_NULL_HANDLE, VK_NULL_HANDLE, VK_NULL_HANDLE, \
        VK_NULL_HANDLE, VK_NULL_HANDLE, 0, 0, BILLOW_COLOR_RGBA16F, 0                                        \
  }

/* Records one dispatch. barriers: all images readable by the compute shader stage, target writable too; afterwards it
 * was read and written by that stage. BILLOW_NOT_READY while detached. */
BILLOW_API BillowResult billowComposite(BillowCompositor* compositor, VkCommandBuffer commands,
                                        const BillowCompositeInfo* info, BillowError* error);

#ifdef __cplusplus
}
#endif

#endif /* BILLOW_BILLOW_H */
