// Parts of drawings and pages as text: what pictures of scenes, diagrams and pages of tables share.
#pragma once

#include <fmt/format.h>

#include <string>

namespace gravitas {

// Text inside of SVG or HTML.
inline std::string in_markup(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else {
      out += c;
    }
  }
  return out;
}

// Points of the page, y down.
inline std::string svg_line(double x1, double y1, double x2, double y2, const std::string& style = {}) {
  return fmt::format("<line x1=\"{:.2f}\" y1=\"{:.2f}\" x2=\"{:.2f}\" y2=\"{:.2f}\"{}/>\n", x1, y1, x2, y2,
                     style.empty() ? "" : " " + style);
}

inline std::string svg_text(double x, double y, const std::string& text, const std::string& style = {}) {
  return fmt::format("<text x=\"{:.2f}\" y=\"{:.2f}\"{}>{}</text>\n", x, y, style.empty() ? "" : " " + style,
                     in_markup(text));
}

// A whole drawing on white, sans-serif of 11 points.
inline std::string svg_page(double width, double height, const std::string& parts) {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} {1:.0f}\" "
      "font-family=\"sans-serif\" font-size=\"11\" stroke-width=\"1\">\n"
      "<rect width=\"{0:.0f}\" height=\"{1:.0f}\" fill=\"white\"/>\n{2}</svg>\n",
      width, height, parts);
}

}  // namespace gravitas
