#pragma once
// What must hold stays checked in release, and every failure a user can meet has a type that knows its exit code.
// Never throw inside a parallel region: collect a flag there and ensure() after it.
#include <stdexcept>
#include <string>

namespace kuzure {

/// The command line or the scene is wrong: exit code 2, nothing was written.
struct BadInput : std::runtime_error {
    using runtime_error::runtime_error;
};
/// The numbers failed: exit code 3. The message names what, where, when, and the remedy.
struct NumbersFailed : std::runtime_error {
    using runtime_error::runtime_error;
};
/// Reading or writing failed: exit code 4.
struct IoFailed : std::runtime_error {
    using runtime_error::runtime_error;
};
/// A rule inside kuzure is broken: a defect of the program, not of the input.
struct Broken : std::logic_error {
    using logic_error::logic_error;
};

inline void ensure(bool holds, const char* otherwise)
{
    if (!holds) throw Broken(otherwise);
}

} // namespace kuzure
