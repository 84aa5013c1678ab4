#include "import/inputs.h"
#include "import/input_notes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <glob.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <filesystem>
#include <optional>
#include <set>
#include <system_error>

namespace billow::compiler {
namespace {

namespace fs = std::filesystem;

struct FoundFile {
  std::string path;
  std::optional<std::int32_t> number;
  std::string series;  // the path with the number taken out: files of one sequence share it
};

bool isDigit(char c) {
  return c >= '0' && c <= '9';
}

bool isVdb(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension == ".vdb";
}

std::optional<std::int32_t> parseNumber(std::string_view digits) {
  std::int32_t number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (error != std::errc{} || end != digits.data() + digits.size()) return std::nullopt;
  return number;
}

// The number is the last run of digits in the name without its extension.
FoundFile describe(const std::string& path) {
  FoundFile file{path, std::nullopt, path};
  const std::size_t nameBegin = path.find_last_of('/') == std::string::npos ? 0 : path.find_last_of('/') + 1;
  const std::size_t dot = path.find_last_of('.');
  std::size_t end = dot == std::string::npos || dot < nameBegin ? path.size() : dot;
  while (end > nameBegin && !isDigit(path[end - 1])) --end;
  std::size_t begin = end;
  while (begin > nameBegin && isDigit(path[begin - 1])) --begin;
  if (begin == end) return file;
  file.number = parseNumber(std::string_view(path).substr(begin, end - begin));
  if (file.number) file.series = path.substr(0, begin) + "#" + path.substr(end);
  return file;
}

// A place for a frame number in a name: a run of '#', or %d, or %04d.
struct Pattern {
  std::size_t begin, end;
  std::size_t digits;  // at least so many, padded with zeros; 0 or 1: any
};

std::optional<Pattern> findPattern(const std::string& name) {
  const std::size_t hash = name.find_last_of('#');
  if (hash != std::string::npos) {
    std::size_t begin = hash;
    while (begin > 0 && name[begin - 1] == '#') --begin;
    return Pattern{begin, hash + 1, hash + 1 - begin};
  }
  const std::size_t percent = name.find_last_of('%');
  if (percent == std::string::npos) return std::nullopt;
  std::size_t end = percent + 1;
  while (end < name.size() && isDigit(name[end])) ++end;
  if (end == name.size() || name[end] != 'd') return std::nullopt;
  const auto digits = parseNumber(std::string_view(name).substr(percent + 1, end - percent - 1));
  return Pattern{percent, end + 1, static_cast<std::size_t>(std::clamp(digits.value_or(0), 0, 10))};
}

bool fits(std::string_view digits, std::size_t padding) {
  if (digits.empty() || !std::all_of(digits.begin(), digits.end(), isDigit)) return false;
  if (padding <= 1 || digits.size() == padding) return true;
  return digits.size() > padding && digits[0] != '0';
}

template <class Visit>
void forEachFile(const fs::path& directory, const Visit& visit) {
  std::error_code error;
  fs::directory_iterator entries(directory, error);
  for (; !error && entries != fs::directory_iterator(); entries.increment(error)) visit(entries->path());
  if (error) {
    throw Error(Fault::file, fmt::format("{}: cannot be listed: {}", directory.string(), error.message()));
  }
}

std::vector<FoundFile> expandPattern(const std::string& input, const Pattern& pattern, const std::string& name) {
  const std::string directory = input.substr(0, input.size() - name.size());
  noteInput(directory.empty() ? "." : directory);
  const std::string head = name.substr(0, pattern.begin), tail = name.substr(pattern.end);
  std::vector<FoundFile> found;
  forEachFile(directory.empty() ? "." : directory, [&](const fs::path& path) {
    const std::string file = path.filename().string();
    if (file.size() <= head.size() + tail.size() || !file.starts_with(head) || !file.ends_with(tail)) return;
    const std::string digits = file.substr(head.size(), file.size() - head.size() - tail.size());
    if (!fits(digits, pattern.digits)) return;
    const auto number = parseNumber(digits);
    if (number) found.push_back({directory + file, number, directory + head + "#" + tail});
  });
  if (found.empty()) throw Error(Fault::file, fmt::format("{}: no file matches this pattern", input));
  return found;
}

std::vector<FoundFile> expandDirectory(const std::string& input) {
  std::vector<FoundFile> found;
  noteInput(input);
  forEachFile(input, [&](const fs::path& path) {
    const bool hidden = path.filename().string().starts_with('.');  // "._smoke_0001.vdb" is a Mac's, and no VDB
    if (isVdb(path) && !hidden) found.push_back(describe(path.string()));
  });
  if (found.empty()) throw Error(Fault::file, fmt::format("{}: no .vdb file in this directory", input));
  return found;
}

// A match may come or go in any folder that the pattern's parts match.
void noteFolders(const std::string& input) {
  for (std::size_t slash = input.find_last_of('/'); slash != std::string::npos && slash > 0;
       slash = input.find_last_of('/', slash - 1)) {
    const std::string part = input.substr(0, slash);
    glob_t folders{};
    if (::glob(part.c_str(), GLOB_ONLYDIR, nullptr, &folders) == 0) {
      for (std::size_t i = 0; i < folders.gl_pathc; ++i) noteInput(folders.gl_pathv[i]);
    }
    ::globfree(&folders);
    if (part.find_first_of("*?[") == std::string::npos) return;
  }
  noteInput(input.front() == '/' ? "/" : ".");
}

std::vector<FoundFile> expandGlob(const std::string& input) {
  noteFolders(input);
  glob_t matches{};
  const int result = ::glob(input.c_str(), 0, nullptr, &matches);
  std::vector<FoundFile> found;
  for (std::size_t i = 0; result == 0 && i < matches.gl_pathc; ++i) found.push_back(describe(matches.gl_pathv[i]));
  ::globfree(&matches);
  if (found.empty()) throw Error(Fault::file, fmt::format("{}: no file matches this pattern", input));
  return found;
}

std::vector<FoundFile> expand(const std::string& input) {
  std::error_code ignored;
  if (fs::is_directory(input, ignored)) return expandDirectory(input);
  if (fs::exists(input, ignored)) return {describe(input)};
  const std::string name = input.substr(input.find_last_of('/') + 1);
  if (const auto pattern = findPattern(name)) return expandPattern(input, *pattern, name);
  if (input.find_first_of("*?[") != std::string::npos) return expandGlob(input);
  throw Error(Fault::file, fmt::format("{}: no such file or directory", input));
}

// A file alone is that frame only when the number ends its name: in "vec3f_only.vdb" no frame is meant.
std::int32_t loneNumber(const FoundFile& file) {
  const std::string stem = fs::path(file.path).stem().string();
  return file.number && !stem.empty() && isDigit(stem.back()) ? *file.number : 0;
}

// At most eight of them in a message.
template <class Items>
std::string some(const Items& items) {
  std::vector<std::string> shown;
  for (const auto& item : items) {
    if (shown.size() == 8) {
      shown.push_back(fmt::format("... ({} in all)", items.size()));
      break;
    }
    shown.push_back(fmt::format("{}", item));
  }
  return fmt::format("{}", fmt::join(shown, ", "));
}

void checkNumbered(const std::vector<FoundFile>& files) {
  for (const FoundFile& file : files) {
    if (file.number) continue;
    throw Error(Fault::input, fmt::format("{}: no frame number in the name, and {} other files were given; compile it "
                                          "alone, or say in a manifest what belongs together",
                                          file.path, files.size() - 1));
  }
}

// Several series are layers of one sequence only where they count the same frames.
void checkSeries(const std::map<std::string, std::set<std::int32_t>>& series) {
  const auto& [firstName, firstNumbers] = *series.begin();
  for (const auto& [name, numbers] : series) {
    if (numbers == firstNumbers) continue;
    throw Error(Fault::input,
                fmt::format("the inputs mix several sequences, {} (frames {}) and {} (frames {}); give one of them, or "
                            "a manifest with a volume for each",
                            firstName, some(firstNumbers), name, some(numbers)));
  }
}

std::string missingMessage(const std::vector<std::int32_t>& missing, const NumberedFiles& files) {
  const std::int32_t first = files.begin()->first, last = files.rbegin()->first;
  std::string text = fmt::format("frames are missing between {} and {}: {}", first, last, some(missing));
  if (files.size() > 1) {
    const std::int32_t step = std::next(files.begin())->first - first;
    bool even = step > 1;
    for (const auto& [number, paths] : files) even = even && (number - first) % step == 0;
    if (even) text += fmt::format("; --frames {}-{}:{} takes every {}th", first, last, step, step);
  }
  return text + "; --missing hold repeats the frame before, --missing blank leaves them empty";
}

}  // namespace

NumberedFiles findFiles(const std::vector<std::string>& inputs) {
  std::vector<FoundFile> files;
  for (const std::string& input : inputs) {
    const auto found = expand(input);
    files.insert(files.end(), found.begin(), found.end());
  }
  std::sort(files.begin(), files.end(), [](const FoundFile& a, const FoundFile& b) { return a.path < b.path; });
  files.erase(
      std::unique(files.begin(), files.end(), [](const FoundFile& a, const FoundFile& b) { return a.path == b.path; }),
      files.end());
  if (files.empty()) throw Error(Fault::commandLine, "no input was given");
  if (files.size() == 1) return {{loneNumber(files[0]), {files[0].path}}};
  checkNumbered(files);
  std::map<std::string, std::set<std::int32_t>> series;
  NumberedFiles numbered;
  for (const FoundFile& file : files) {
    std::vector<std::string>& frame = numbered[*file.number];
    if (!series[file.series].insert(*file.number).second) {
      throw Error(Fault::input, fmt::format("{}: frame {} is there twice, also as {}", file.path, *file.number,
                                            fmt::join(frame, ", ")));
    }
    frame.push_back(file.path);
  }
  checkSeries(series);
  return numbered;
}

std::vector<PlannedFrame> selectFrames(const NumberedFiles& files, const ImportOptions& options) {
  const std::int64_t first = options.firstFrame.value_or(files.begin()->first);
  const std::int64_t last = options.lastFrame.value_or(files.rbegin()->first);
  if (first > last || options.frameStep < 1) {
    throw Error(Fault::commandLine, fmt::format("no frame lies in {}-{}:{} (the sequence has {} to {})", first, last,
                                                options.frameStep, files.begin()->first, files.rbegin()->first));
  }
  std::vector<PlannedFrame> frames;
  std::vector<std::int32_t> missing;
  constexpr std::int64_t kMostFrames = 1 << 20;  // a stray number in one name must not ask for years of frames
  if (options.missing != MissingFrames::error && (last - first) / options.frameStep >= kMostFrames) {
    throw Error(Fault::input, fmt::format("frames {} to {} are more than {}", first, last, kMostFrames));
  }
  for (std::int64_t n = first; n <= last && missing.size() < 1000; n += options.frameStep) {
    PlannedFrame frame;
    frame.number = static_cast<std::int32_t>(n);
    const auto found = files.find(frame.number);
    if (found != files.end()) {
      frame.files = found->second;
    } else if (options.missing == MissingFrames::hold && !frames.empty()) {
      frame.files = frames.back().files;
      frame.flags = format::kFrameHeld;
    } else if (options.missing == MissingFrames::blank) {
      frame.flags = format::kFrameBlank;
    } else {
      missing.push_back(frame.number);
    }
    frames.push_back(std::move(frame));
  }
  if (missing.empty()) return frames;
  if (options.missing == MissingFrames::hold) {
    throw Error(Fault::input, fmt::format("frame {} is missing, and there is no frame before it to hold", missing[0]));
  }
  throw Error(Fault::input, missingMessage(missing, files));
}

}  // namespace billow::compiler
