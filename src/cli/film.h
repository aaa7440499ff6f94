#pragma once
// Pictures and films of pages, made by a headless browser.
#include <string>
#include <vector>

namespace bielle::cli {

struct FilmOptions {
  std::vector<double> times;      // s
  int width = 480, height = 480;  // of one picture
  int columns = 0;                // of a strip; 0: automatic
  std::string view = "oblique";
  bool side_by_side = true;  // several robots; otherwise in one place
  bool see_through = false;
  std::string show, hide;  // layers, separated by commas
};

// The page as it opens, 1280 by 1000 pixels, as PNG. \throws InputError as writeStrip() does
void writeScreenshot(const std::string& page, const std::string& path);

// Of a report, one PNG with a picture per time. \throws InputError when there is no browser, or it fails
void writeStrip(const std::string& page, const FilmOptions& options, const std::string& path);

// Of a report, H.264, `rate` pictures per second of real time. \throws InputError when there is no browser or no ffmpeg, or one
// fails
void writeFilm(const std::string& page, const FilmOptions& options, double rate, const std::string& path);

}  // namespace bielle::cli
