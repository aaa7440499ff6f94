#include "cli/film.h"

#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "bielle/model/error.h"
#include "cli/table.h"
#include "formats/aside_file.h"
#include "formats/process.h"

namespace fs = std::filesystem;

namespace bielle::cli {
namespace {

class ScratchDirectory {
 public:
  ScratchDirectory() {
    std::string pattern = (fs::temp_directory_path() / "bielle_film_XXXXXX").string();
    if (!mkdtemp(pattern.data())) failToWrite(pattern, "a scratch directory could not be created");
    path_ = pattern;
  }
  ~ScratchDirectory() {
    std::error_code error;
    fs::remove_all(path_, error);
  }
  ScratchDirectory(const ScratchDirectory&) = delete;
  ScratchDirectory& operator=(const ScratchDirectory&) = delete;
  fs::path operator/(const std::string& name) const { return path_ / name; }

 private:
  fs::path path_;
};

std::string findBrowser() {
  for (const char* name : {"chromium", "chromium-browser", "google-chrome"})
    if (isOnPath(name)) return name;
  throw InputError("", "browser", "Chromium, which draws the pictures, is not on the PATH",
                   "install it (Debian: chromium), or open the page with any browser");
}

// Escapes characters with a meaning in a URL.
std::string escapeUrl(const std::string& text) {
  std::string out;
  for (unsigned char c : text) {
    char code[4];
    std::snprintf(code, sizeof code, "%%%02X", c);
    out += std::isalnum(c) || std::string("/._-,").find(static_cast<char>(c)) != std::string::npos
               ? std::string(1, static_cast<char>(c))
               : code;
  }
  return out;
}

std::string makeAddress(const std::string& page) { return "file://" + escapeUrl(fs::absolute(page).string()); }

std::string makeAddress(const std::string& page, const FilmOptions& options, bool separate) {
  std::string times;
  for (double t : options.times) times += (times.empty() ? "" : ",") + formatNumber(t, "%.4f");
  std::string address = makeAddress(page) + "#film=" + times + "&size=" + std::to_string(options.width) + "x" +
                        std::to_string(options.height) + "&view=" + escapeUrl(options.view) +
                        "&columns=" + std::to_string(options.columns);
  if (separate) address += "&separate=1";
  if (!options.side_by_side) address += "&apart=0";
  if (options.see_through) address += "&through=1";
  if (!options.show.empty()) address += "&show=" + escapeUrl(options.show);
  if (!options.hide.empty()) address += "&hide=" + escapeUrl(options.hide);
  return address;
}

std::string decodeBase64(const std::string& text) {
  static const std::string kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned bits = 0;
  int count = 0;
  for (char c : text) {
    const size_t digit = kDigits.find(c);
    if (digit == std::string::npos) break;
    bits = (bits << 6 | static_cast<unsigned>(digit)) & 0xffffff;
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 255);
  }
  return bytes;
}

// Runs the browser on an address, with options of one's own.
ProcessOutput browse(const ScratchDirectory& scratch, const std::vector<std::string>& options,
                     const std::string& address, double seconds) {
  std::vector<std::string> arguments = {findBrowser(),
                                        "--headless",
                                        "--no-sandbox",
                                        "--disable-gpu",
                                        "--use-gl=angle",
                                        "--use-angle=swiftshader",
                                        "--enable-unsafe-swiftshader",
                                        "--disable-quic",
                                        "--no-first-run",
                                        "--disable-background-networking",
                                        "--disable-component-update",
                                        "--disable-sync",
                                        "--user-data-dir=" + (scratch / "profile").string(),
                                        "--timeout=" + std::to_string(static_cast<int>(1000 * seconds))};
  arguments.insert(arguments.end(), options.begin(), options.end());
  arguments.push_back(address);
  return runProcess(arguments, seconds);
}

// The images that the page stores in its document (film.js), as bytes of their formats.
std::vector<std::string> takePictures(const std::string& page, const FilmOptions& options, bool separate) {
  const ScratchDirectory scratch;
  const double seconds = 60 + 4.0 * static_cast<double>(options.times.size());
  const ProcessOutput result = browse(scratch, {"--dump-dom"}, makeAddress(page, options, separate), seconds);
  std::vector<std::string> pictures;
  const std::string mark = ";base64,", begin = "<img class=\"film\" src=\"data:image/";
  for (size_t at = 0; (at = result.out.find(begin, at)) != std::string::npos;) {
    at = result.out.find(mark, at) + mark.size();
    const size_t end = result.out.find('"', at);
    pictures.push_back(decodeBase64(result.out.substr(at, end - at)));
  }
  if (pictures.size() != (separate ? options.times.size() : 1))
    throw InputError(page, "pictures", "the browser drew only some of them, or none",
                     "open the page to see whether the browser supports WebGL; request fewer or smaller pictures");
  return pictures;
}

}  // namespace

void writeStrip(const std::string& page, const FilmOptions& options, const std::string& path) {
  AsideFile file(path);
  file.write(takePictures(page, options, false).front());
  file.commit();
}

void writeScreenshot(const std::string& page, const std::string& path) {
  constexpr double kLongest = 60;  // s
  const ScratchDirectory scratch;
  const std::string made = (scratch / "page.png").string();
  browse(scratch,
         {"--window-size=1280,1000", "--hide-scrollbars", "--virtual-time-budget=3000", "--screenshot=" + made},
         makeAddress(page), kLongest);
  std::error_code error;
  if (fs::file_size(made, error) == 0 || error)
    throw InputError(path, "picture", "the browser drew none",
                     "open the page to see whether the browser supports WebGL");
  std::ifstream picture(made, std::ios::binary);
  AsideFile file(path);
  file.write({std::istreambuf_iterator<char>(picture), std::istreambuf_iterator<char>()});
  file.commit();
}

void writeFilm(const std::string& page, const FilmOptions& options, double rate, const std::string& path) {
  if (!isOnPath("ffmpeg"))
    throw InputError("", "ffmpeg", "it is not on the PATH, but is needed to make films", "install it (Debian: ffmpeg)");
  const std::vector<std::string> pictures = takePictures(page, options, true);
  const ScratchDirectory scratch;
  for (size_t i = 0; i < pictures.size(); ++i) {
    char name[32];
    std::snprintf(name, sizeof name, "%06zu.jpg", i);
    std::ofstream(scratch / name, std::ios::binary) << pictures[i];
  }
  const std::string made = (scratch / "film.mp4").string();
  const ProcessOutput result = runProcess(
      {"ffmpeg", "-loglevel", "error", "-framerate", formatNumber(rate), "-i", (scratch / "%06d.jpg").string(), "-c:v",
       "libx264", "-pix_fmt", "yuv420p", "-movflags", "+faststart", made},
      600);
  std::error_code error;
  if (result.status != 0 || fs::file_size(made, error) == 0 || error)
    throw InputError(path, "film", "ffmpeg could not encode it", "check that it supports libx264; give an even size");
  std::ifstream film(made, std::ios::binary);
  AsideFile file(path);
  file.write({std::istreambuf_iterator<char>(film), std::istreambuf_iterator<char>()});
  file.commit();
}

}  // namespace bielle::cli
