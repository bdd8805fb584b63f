#pragma once
// HTML: escaped text, files inside the page, the look of the report.
#include <string>
#include <string_view>

namespace kuzure::report {

/// Text as it stands between tags or inside a quoted attribute.
std::string escaped(std::string_view);

/// A file's bytes as a URI: "data:image/png;base64,...".
std::string data_uri(std::string_view mime_type, std::string_view bytes);

/// A whole page around its body; everything it needs is inside.
std::string page(std::string_view title, std::string_view body);

} // namespace kuzure::report
