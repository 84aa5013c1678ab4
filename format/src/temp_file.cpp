#include "billow/format/temp_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstring>
#include <system_error>
#include <utility>

namespace billow::format {
namespace {

// What a signal handler may read: plain memory behind lock-free flags, no allocation.
struct Slot {
  enum State : int { free, claimed, named };
  std::atomic<int> state{free};
  char name[PATH_MAX] = {};
};
static_assert(std::atomic<int>::is_always_lock_free);
Slot slots[8];

// -1 where the name is too long or all slots are taken: the file is then only removed by its destructor.
int claimSlot(const std::string& name) {
  if (name.size() >= PATH_MAX) return -1;
  for (int i = 0; i < static_cast<int>(std::size(slots)); ++i) {
    int expected = Slot::free;
    if (!slots[i].state.compare_exchange_strong(expected, Slot::claimed)) continue;
    std::memcpy(slots[i].name, name.c_str(), name.size() + 1);
    slots[i].state.store(Slot::named);
    return i;
  }
  return -1;
}

void releaseSlot(int& slot) {
  if (slot >= 0) slots[slot].state.store(Slot::free);
  slot = -1;
}

}  // namespace

void removeUnfinishedFiles() noexcept {
  for (Slot& slot : slots) {
    if (slot.state.load() == Slot::named) ::unlink(slot.name);
  }
}

TempFile::TempFile(std::string path) : path_(std::move(path)) {
  const std::size_t slash = path_.rfind('/');
  folder_ = slash == std::string::npos ? "./" : path_.substr(0, slash + 1);
  const std::string name = slash == std::string::npos ? path_ : path_.substr(slash + 1);
  if (name.empty()) fail(EISDIR, "cannot be written");
  struct stat status {};
  // Renaming over a device or a pipe would replace it by a plain file.
  if (::stat(path_.c_str(), &status) == 0 && !S_ISREG(status.st_mode)) {
    fail(S_ISDIR(status.st_mode) ? EISDIR : EEXIST, "is not a plain file and cannot be replaced");
  }
  temporary_ = fmt::format("{}.{}.tmp-{}", slash == std::string::npos ? "" : folder_, name, ::getpid());
  open();
}

void TempFile::open() {
  const std::string base = temporary_;
  int error = 0;
  // A file of the same name is left from a killed process that had our number: step aside, it isn't ours to remove.
  for (int attempt = 0; attempt < 100; ++attempt) {
    if (attempt > 0) temporary_ = fmt::format("{}-{}", base, attempt);
    // Named before it exists, so that a signal at any moment leaves nothing behind.
    slot_ = claimSlot(temporary_);
    descriptor_ = ::open(temporary_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor_ >= 0) return;
    error = errno;
    releaseSlot(slot_);
    if (error != EEXIST) break;
  }
  fail(error, "cannot be created");
}

TempFile::~TempFile() {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  ::unlink(temporary_.c_str());
  releaseSlot(slot_);
}

void TempFile::fail(int error, const char* what) const {
  throw std::system_error(error, std::generic_category(), fmt::format("{}: {}", path_, what));
}

void TempFile::write(std::uint64_t offset, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t wrote = ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) fail(errno, "cannot be written");
    if (wrote == 0) fail(EIO, "cannot be written");
    bytes = bytes.subspan(static_cast<std::size_t>(wrote));
    offset += static_cast<std::uint64_t>(wrote);
  }
}

void TempFile::commit(std::uint64_t size) {
  if (::ftruncate(descriptor_, static_cast<off_t>(size)) != 0) fail(errno, "cannot be written");
  if (::fsync(descriptor_) != 0) fail(errno, "cannot be flushed to the disk");
  if (::rename(temporary_.c_str(), path_.c_str()) != 0) fail(errno, "cannot be given its name");
  releaseSlot(slot_);
  ::close(std::exchange(descriptor_, -1));
  // The file is whole already; flushing its folder only makes the name survive a power cut, and not every file system
  // can do it.
  const int folder = ::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder >= 0) {
    ::fsync(folder);
    ::close(folder);
  }
}

}  // namespace billow::format
