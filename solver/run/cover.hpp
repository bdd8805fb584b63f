#pragma once
// Where soil is, in plan: what of the walls is near it.
#include "solver/core/mix.hpp"
#include "solver/core/particles.hpp"
#include "solver/scene/parts.hpp"
#include <cmath>
#include <unordered_map>
#include <utility>

namespace kuzure {

/// Squares in plan that hold soil or are near some, each with the heights between which that is.
class Cover {
public:
    /// Of particles where they were sorted, with a margin around each, in squares of a side; m.
    Cover(const Particles&, double side, double margin);
    bool holds(Vector x) const;
    /// Every square of the other, of the same side, with all of its heights.
    bool holds(const Cover&) const;
    using Square = std::pair<long, long>;
    /// visit(Square, scene::Box) for each square and its box, which holds points at its edges that are square_of() another.
    template <class Visit> void for_each(Visit visit) const
    {
        const double spare = 1e-6 * side_;
        for (const auto& [square, of] : squares_) {
            const double x = double(square.first) * side_, y = double(square.second) * side_;
            visit(square, scene::Box{{x - spare, y - spare, of.low}, {x + side_ + spare, y + side_ + spare, of.high}});
        }
    }
    Square square_of(Vector x) const { return {std::lround(std::floor(x.x / side_)), std::lround(std::floor(x.y / side_))}; }

private:
    struct Heights {
        double low, high; // m
    };
    struct Mixed {
        std::size_t operator()(Square s) const { return mix(std::uint64_t(s.first) << 32 ^ std::uint64_t(s.second)); }
    };
    double side_;
    std::unordered_map<Square, Heights, Mixed> squares_;
};

} // namespace kuzure
