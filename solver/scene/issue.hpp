#pragma once
// What is wrong, or doubtful, about a scene. The reader turns the key into a file and line.
#include <string>
#include <vector>

namespace kuzure::scene {

enum class Severity { Warning, Error };
struct Issue {
    Severity severity;
    std::string key;   // "body.0.box", as --set writes it
    std::string text;  // what was expected, what was found, the remedy
    std::string other; // the key of the other party, where two things disagree
};
using Issues = std::vector<Issue>;

/// "body.0.box: what was expected ..."
inline std::string in_words(const Issue& issue) { return issue.key + ": " + issue.text; }

} // namespace kuzure::scene
