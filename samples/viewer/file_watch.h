// Tells when a file has been written anew.
#ifndef BILLOW_VIEWER_FILE_WATCH_H
#define BILLOW_VIEWER_FILE_WATCH_H

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace billow::viewer {

class FileWatch {
 public:
  explicit FileWatch(std::string path) : path_(std::move(path)), known_(look()) {}

  const std::string& path() const { return path_; }

  // True once for each time that the file has become another one and stays so from one call to the next: a file that is
  // being written is left alone.
  bool changed() {
    const std::optional<Stamp> now = look();
    const bool rests = now && now == before_;
    before_ = now;
    if (!rests || now == known_) return false;
    known_ = now;
    return true;
  }

 private:
  struct Stamp {
    std::filesystem::file_time_type written;
    std::uintmax_t bytes = 0;
    bool operator==(const Stamp&) const = default;
  };
  std::optional<Stamp> look() const {
    std::error_code error;
    Stamp stamp{.written = std::filesystem::last_write_time(path_, error), .bytes = 0};
    if (error) return std::nullopt;
    stamp.bytes = std::filesystem::file_size(path_, error);
    if (error) return std::nullopt;
    return stamp;
  }

  std::string path_;
  std::optional<Stamp> known_, before_;
};

}  // namespace billow::viewer

#endif  // BILLOW_VIEWER_FILE_WATCH_H
