// The soak: a model of what the streamer was told, and the checks of what it gives.
#ifndef BILLOW_TESTS_SOAK_H
#define BILLOW_TESTS_SOAK_H

#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "../simulated_disk.h"
#include "../stream_host.h"
#include "../vulkan_faults.h"
#include "painter.h"
#include "soak_clock.h"
#include "soak_packs.h"

namespace billow::tests {

struct SoakOptions {
  std::uint64_t operations = 20000;
  std::uint32_t seed = 1;
  double seconds = 0;  // 0: until the operations are done
  bool validation = false;
  bool trace = false;  // each operation on stderr
};

class Soak {
 public:
  explicit Soak(const SoakOptions& options);
  ~Soak();
  void run();
  std::string summary() const;

 private:
  struct Asset {
    runtime::AssetId id;
    // Packs that it may be made of now: more than one while a reload is under way.
    std::vector<std::size_t> contents;
    std::string path;                      // "": it comes from the disk
    bool opening = false;                  // state() has not said ready yet
    bool damaged = false;                  // some of its pages could not be had
    const format::Pack* before = nullptr;  // that a reload must have replaced
  };
  struct Actor {
    runtime::InstanceId id;
    std::size_t asset;
    SoakClock clock;
    float priority = 1;
    bool seen = false;  // something was drawn of it
  };
  // A picture whose commands are not executed yet, and what it must be.
  struct Snapshot {
    std::unique_ptr<Painter::Pending> pending;
    std::vector<std::size_t> contents;
    std::vector<std::uint32_t> frames;
    std::optional<std::uint32_t> other;  // that may be drawn in place of the one
    std::vector<float> weights;
    std::vector<std::uint32_t> bricks;  // of the frames that are drawn
    std::string what;                   // for whom it may concern
    std::uint32_t updatesLeft = 0;
  };
  struct Counts {
    std::uint64_t operations = 0, updates = 0, sessions = 0, drains = 0;
    std::uint64_t shown = 0, full = 0, coarse = 0, held = 0, empty = 0, holes = 0;
    std::uint64_t pictures = 0, lit = 0, unclear = 0;  // compared, with something on them; not comparable
    std::uint64_t opens = 0, refused = 0, reloads = 0, errors = 0, losses = 0, attaches = 0;
    std::uint64_t loaded = 0, evicted = 0;
    std::uint64_t diskFaults = 0, memoryFaults = 0, deviceFaults = 0;
  };

  // soak_session.cpp: from making a streamer to the proof that nothing of it is left
  void beginSession();
  void endSession();
  void makeRenderer();
  void measureBaseline();
  void dropRenderer();
  void drain();
  bool settled();
  [[noreturn]] void failDrain();
  void repair();
  void clearFaults();
  void takeErrors();
  void forgetErrors(const Asset& asset);

  // soak_steps.cpp: what a host may do
  void step();
  void updateOnce();
  void update(double seconds);
  void addInstance();
  void removeInstance();
  void changePlayback();
  void openAsset();
  void closeAsset();
  void reloadAsset();
  void changeBudgets();
  void squeeze();
  void setFaults();
  void loseDevice();
  void reattach();
  void nonsense();
  runtime::Playback anyPlayback();
  runtime::PackSource sourceOf(Asset& asset, std::vector<std::byte> bytes);
  void forgetAsset(std::size_t which);
  void writeFile(std::span<const std::byte> bytes, const std::string& path);
  std::vector<std::byte> spoiled(std::vector<std::byte> bytes);

  // soak_checks.cpp: what must hold
  void check();
  void checkMemory();
  void checkActor(Actor& actor);
  void checkLayers(const runtime::Drawable& drawable) const;
  void takeSnapshot();
  void finishSnapshot();
  std::vector<float> reference(std::size_t content, const Snapshot& snapshot,
                               const std::vector<std::uint32_t>& numbers);
  [[noreturn]] void fail(const std::string& what) const;
  void require(bool holds, const char* what) const {
    if (!holds) fail(what);
  }

  std::uint32_t below(std::uint32_t count) { return static_cast<std::uint32_t>(random_() % count); }
  double share() { return static_cast<double>(random_() >> 8) / 16777216.0; }
  bool chance(double part) { return share() < part; }
  void trace(const char* what) const;

  SoakOptions options_;
  std::mt19937 random_;
  std::vector<SoakPack> packs_;
  std::string folder_;
  std::unique_ptr<headless::VulkanDevice> device_;
  std::unique_ptr<runtime::Renderer> referenceRenderer_;
  std::unique_ptr<Painter> referencePainter_;

  std::unique_ptr<SimulatedDisk> disk_;
  std::unique_ptr<HostJobs> jobs_;
  std::unique_ptr<CountingAllocator> allocator_;
  std::unique_ptr<runtime::Renderer> renderer_;
  std::unique_ptr<Painter> painter_;
  runtime::StreamConfig config_;
  std::unique_ptr<runtime::Streamer> streamer_;
  bool attached_ = true;
  bool viewed_ = false;                        // updates have a view: levels may be coarser than the finest, and right
  bool stalled_ = false;                       // no read ends
  bool faulty_ = false;                        // something was let fail since the last drain
  bool comfortable_ = true;                    // budgets had room for everything since the last drain
  bool comparable_ = true;                     // no page that was read wrongly may be drawn
  std::uint64_t gpuBound_ = 0, cpuBound_ = 0;  // what may be held now
  std::uint64_t gpuBaseline_ = 0, hostBaseline_ = 0;  // of the renderer and the painter
  std::vector<Asset> assets_;
  std::vector<Actor> actors_;
  std::optional<Snapshot> snapshot_;
  std::set<std::string> told_;  // errors since the last drain
  std::uint64_t files_ = 0;
  Counts counts_;
};

}  // namespace billow::tests

#endif  // BILLOW_TESTS_SOAK_H
