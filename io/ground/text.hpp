#pragma once
// Text of other programs: in whatever code page, as UTF-8.
#include <string>

namespace kuzure::io::ground {

bool is_utf8(const std::string&);
/// As UTF-8: what is not so already is taken to be of this code page, or Shift-JIS, or Latin-1.
std::string as_utf8(const std::string& text, const std::string& code_page = "");

} // namespace kuzure::io::ground
