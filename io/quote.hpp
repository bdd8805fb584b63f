#pragma once
// Text of users on its way into another language: one function for each, and nothing of theirs goes there without it.
#include <string>
#include <string_view>

namespace kuzure::io {

/// One word of bash, on one line: in single quotes, where nothing but the quote itself has a meaning; control characters as $'\n', for
/// batch systems look for their own lines wherever they stand. Throws BadInput for a zero byte.
std::string shell_word(std::string_view);
/// A string of gnuplot in single quotes: no backtick runs a command there. What would end the line becomes a space.
std::string gnuplot_string(std::string_view);
/// One line for a comment: control characters, and line breaks of any kind, become spaces.
std::string comment_text(std::string_view);
/// The value of an option of a batch system ("#SBATCH --account=..."): letters, digits and -_.,:=+@%/ only, and no - in front. `what` is
/// what messages call it ("--account"). Throws BadInput for anything else.
std::string batch_value(std::string_view, std::string_view what);
/// Position of the first byte that is not well-formed UTF-8, or npos.
std::size_t malformed(std::string_view);
/// For a terminal: control characters but line breaks and tabs, and bytes that are no UTF-8, as \x1b, so that a file's or a scene's words
/// move no cursor.
std::string printable(std::string_view);

} // namespace kuzure::io
