#include "billow/format/source.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "rules.h"

namespace billow::format {
namespace {

class FileSource : public ByteSource {
 public:
  FileSource(int descriptor, std::uint64_t bytes) : descriptor_(descriptor), size_(bytes) {}
  ~FileSource() override { ::close(descriptor_); }

  std::uint64_t size() const override { return size_; }

  bool read(std::uint64_t offset, std::span<std::byte> into) const override {
    if (offset > size_ || into.size() > size_ - offset) return false;
    while (!into.empty()) {
      const ssize_t got = ::pread(descriptor_, into.data(), into.size(), static_cast<off_t>(offset));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) return false;
      into = into.subspan(static_cast<std::size_t>(got));
      offset += static_cast<std::uint64_t>(got);
    }
    return true;
  }

 private:
  int descriptor_;
  std::uint64_t size_;
};

class MemorySource : public ByteSource {
 public:
  explicit MemorySource(std::vector<std::byte> bytes) : bytes_(std::move(bytes)) {}

  std::uint64_t size() const override { return bytes_.size(); }

  bool read(std::uint64_t offset, std::span<std::byte> into) const override {
    if (offset > bytes_.size() || into.size() > bytes_.size() - offset) return false;
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset), into.size(), into.begin());
    return true;
  }

 private:
  std::vector<std::byte> bytes_;
};

tl::unexpected<Issue> refused(int error) {
  return tl::make_unexpected(makeIssue(Rule::cannotOpen, {}, fmt::format("{}.", std::strerror(error))));
}

}  // namespace

Result<std::unique_ptr<ByteSource>> openFileSource(const std::string& path) {
  // O_NONBLOCK: opening a pipe that nobody writes to must not hang; plain files don't care.
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return refused(errno);
  struct stat status {};
  const int error = ::fstat(descriptor, &status) != 0 ? errno : S_ISDIR(status.st_mode) ? EISDIR : 0;
  if (error != 0) {
    ::close(descriptor);
    return refused(error);
  }
  if (!S_ISREG(status.st_mode)) {
    ::close(descriptor);
    return tl::make_unexpected(makeIssue(Rule::cannotOpen, {}, "It is not a plain file."));
  }
  return std::make_unique<FileSource>(descriptor, static_cast<std::uint64_t>(status.st_size));
}

Result<std::string> readTextFile(const std::string& path) {
  const auto source = openFileSource(path);
  if (!source) return tl::make_unexpected(source.error());
  if ((*source)->size() > kMostTextBytes) return refused(EFBIG);
  std::string text((*source)->size(), '\0');
  if (!(*source)->read(0, std::as_writable_bytes(std::span(text)))) return refused(EIO);
  return text;
}

std::unique_ptr<ByteSource> makeMemorySource(std::vector<std::byte> bytes) {
  return std::make_unique<MemorySource>(std::move(bytes));
}

}  // namespace billow::format
