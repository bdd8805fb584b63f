#pragma once
// The wall particles as files and pictures show them: where they are, nothing that moves.
#include "solver/core/tensor.hpp"
#include <cstdint>
#include <vector>

namespace kuzure::io {

/// The wall particles of this rank. The three have one length.
struct WallPoints {
    std::vector<Vector> position; // m
    std::vector<std::int64_t> id;
    std::vector<double> density; // kg/m^3, constant
    std::size_t size() const { return position.size(); }
};

} // namespace kuzure::io
