// A file under construction, of any kind: written under a temporary name beside its own, renamed when it is whole,
// removed otherwise. Every output of billow is written through it.
#ifndef BILLOW_FORMAT_TEMP_FILE_H
#define BILLOW_FORMAT_TEMP_FILE_H

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace billow::format {

// Removes the temporary files that are not finished. Async-signal-safe: a program that may be interrupted calls it from
// its handler of SIGINT and SIGTERM, then ends.
void removeUnfinishedFiles() noexcept;

// Every member throws std::system_error, with the final path in its message, when the system refuses.
class TempFile {
 public:
  explicit TempFile(std::string path);
  TempFile(const TempFile&) = delete;
  TempFile& operator=(const TempFile&) = delete;
  ~TempFile();

  const std::string& path() const { return path_; }
  // For a library that writes files by name; it may replace the content, not the file.
  const std::string& temporaryPath() const { return temporary_; }
  void write(std::uint64_t offset, std::span<const std::byte> bytes);
  // Sets the size, flushes to the disk and gives the file its name.
  void commit(std::uint64_t size);

 private:
  void open();
  [[noreturn]] void fail(int error, const char* what) const;

  std::string path_;
  std::string folder_;
  std::string temporary_;
  int descriptor_ = -1;
  int slot_ = -1;  // where a signal handler finds the temporary name
};

}  // namespace billow::format

#endif  // BILLOW_FORMAT_TEMP_FILE_H
