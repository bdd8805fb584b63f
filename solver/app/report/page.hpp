#pragma once
// HTML: escaped text, files inside the page, the look of the report.
#include <string>
#include <string_view>

namespace kuzure::report {

/// Text as it stands between tags or inside a quoted attribute.
std::string escaped(std::string_view);

/// A file's bytes as a URI: "data:image/png;base64,...".
std::string data_uri(std::string_view mime_type, std::string_view bytes);

/// A part of the page under a heading; nothing where its body is empty.
std::string section(const char* id, const char* title, const std::string& body);
/// A number with its name, for a <dl class="cards">; `more` stands below it in small.
std::string card(const char* name, const std::string& value, const std::string& more = {});

/// A whole page around its body; everything it needs is inside.
std::string page(std::string_view title, std::string_view body);

} // namespace kuzure::report
