#pragma once
// A job's script from a template: jobs/machines/SYSTEM.job.sh, one for each batch system. Values come in quoted for where they stand; a
// template that asks for what there is not is refused.
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace kuzure::io {

/// What stands for a placeholder {{name}}. No value at all leaves an `if` of its name false.
struct BatchValue {
    enum class Kind {
        Text,   // numbers, values of the batch system's options, commands of the profile: as they are
        Word,   // one or more words of bash, quoted; refused inside a template's quotes, where they would come apart
        Lines,  // the line is repeated for each; with none it goes
        Options // Lines of the profile: one that begins with # is a line of its own
    };
    Kind kind = Kind::Text;
    std::vector<std::string> lines; // Text and Word: one
};
using BatchValues = std::map<std::string, BatchValue>;

/// The file of a batch system's template or of a part of one: beside the profile first, then in the folders; empty where there is none.
std::filesystem::path template_file(const std::string& name, const std::vector<std::filesystem::path>& folders);
/// Names of the batch systems that have a template SYSTEM.job.sh in one of the folders, sorted.
std::vector<std::string> batch_systems(const std::vector<std::filesystem::path>& folders);

/// Fills a template. Its language, a line each: {{name}} anywhere; {{if name}}, {{if not name}}, {{end}} and {{include FILE}} alone on a
/// line; lines that begin with ## are the template's own comments and go. Throws BadInput with
/// `file:line: placeholder: expected, found, remedy`.
std::string fill_template(const std::filesystem::path& file, const BatchValues&, const std::vector<std::filesystem::path>& folders);

} // namespace kuzure::io
