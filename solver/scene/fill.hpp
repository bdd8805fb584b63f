#pragma once
// The particles a scene starts with, computed and never stored: the lattice points of bodies and walls, by id
// or by region. Every rank and every region gets the same bits, because one function computes every coordinate.
#include "solver/scene/draped.hpp"
#include "solver/scene/issue.hpp"
#include "solver/scene/lattice.hpp"
#include "solver/scene/scene.hpp"
#include <cstdint>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

namespace kuzure::scene {

/// The particles of one shape: on a lattice of its own, or draped over the ground.
class Points {
public:
    Points(Lattice lattice) : of_(std::move(lattice)) {}
    Points(Draped draped) : of_(std::move(draped)) {}
    const Lattice* lattice() const { return std::get_if<Lattice>(&of_); }
    const Draped* draped() const { return std::get_if<Draped>(&of_); }
    std::int64_t size() const
    {
        return std::visit([](const auto& p) { return p.size(); }, of_);
    }
    const Box& bounds() const
    {
        return std::visit([](const auto& p) -> const Box& { return p.bounds(); }, of_);
    }
    Vector position(std::int64_t local) const
    {
        return std::visit([&](const auto& p) { return p.position(local); }, of_);
    }
    std::int64_t count_in(const Box& region) const
    {
        return std::visit([&](const auto& p) { return p.count_in(region); }, of_);
    }
    std::optional<GridPart> grid_in(const Box& region) const { return lattice() ? lattice()->grid_in(region) : std::nullopt; }
    template <class Visit> void for_each_in(const Box& region, Visit visit) const
    {
        std::visit([&](const auto& p) { p.for_each_in(region, visit); }, of_);
    }
    template <class Visit> void for_each_stack_in(const Box& region, Visit visit) const
    {
        std::visit([&](const auto& p) { p.for_each_stack_in(region, visit); }, of_);
    }

private:
    std::variant<Lattice, Draped> of_;
};

/// All bodies and walls of a scene. Ids from 0: soil in file order, then walls.
class Filling {
public:
    /// Throws BadInput with the text of every error that problems() finds.
    explicit Filling(const Scene&);
    /// Boxes that do not hold whole particles, empty bodies, overlaps.
    static Issues problems(const Scene&);
    /// The filling, or nothing and what problems() says.
    static std::optional<Filling> of(const Scene&, Issues& problems);

    std::int64_t soil_count() const { return first_id_[n_bodies_]; }
    std::int64_t wall_count() const { return first_id_.back() - soil_count(); }
    /// Particles of one body or wall.
    std::int64_t body_count(int body) const { return points_[std::size_t(body)].size(); }
    std::int64_t wall_count(int wall) const { return points_[n_bodies_ + std::size_t(wall)].size(); }
    /// The smallest box around all soil particles (m), and around all particles.
    const Box& soil_bounds() const { return soil_bounds_; }
    /// Height of the soil from its foot to its top, m; of soil on real ground its greatest thickness.
    double soil_height() const { return soil_height_; }
    const Box& bounds() const { return bounds_; }

    /// Calls visit(std::int64_t id, Vector x, int body) for the soil particles in a closed region, by rising id.
    template <class Visit> void for_each_soil_in(const Box& region, Visit visit) const
    {
        for (std::size_t b = 0; b < n_bodies_; ++b)
            points_[b].for_each_in(region, [&](std::int64_t k, Vector x) { visit(first_id_[b] + k, x, int(b)); });
    }
    /// Calls visit(Stack) for the stacks of one body's particles in a closed region.
    template <class Visit> void for_each_stack_of(int body, const Box& region, Visit visit) const
    {
        points_[std::size_t(body)].for_each_stack_in(region, visit);
    }
    /// Calls visit(Stack, int body) for the stacks of soil particles in a closed region.
    template <class Visit> void for_each_soil_stack_in(const Box& region, Visit visit) const
    {
        for (std::size_t b = 0; b < n_bodies_; ++b) points_[b].for_each_stack_in(region, [&](const Stack& s) { visit(s, int(b)); });
    }
    /// Calls visit(std::int64_t id, Vector x, int wall) for the wall particles in a closed region, by rising id.
    template <class Visit> void for_each_wall_in(const Box& region, Visit visit) const
    {
        for (std::size_t w = n_bodies_; w < points_.size(); ++w)
            points_[w].for_each_in(region, [&](std::int64_t k, Vector x) { visit(first_id_[w] + k, x, int(w - n_bodies_)); });
    }
    /// Calls visit(std::int64_t id, Vector x) for all particles of one wall as it is drawn, by rising id.
    template <class Visit> void for_each_of_wall(int wall, Visit visit) const
    {
        const Points& points = points_[n_bodies_ + std::size_t(wall)];
        for (std::int64_t k = 0; k < points.size(); ++k) visit(first_id_[n_bodies_ + std::size_t(wall)] + k, points.position(k));
    }
    /// How many wall particles pictures and snapshots show: all but those deep in real ground.
    std::int64_t shown_wall_count() const
    {
        std::int64_t n = 0;
        for (std::size_t w = n_bodies_; w < points_.size(); ++w) n += shown(points_[w]);
        return n;
    }
    /// Calls visit(std::int64_t id, Vector x) for the begin-th to the last before the end-th of them, as drawn, by rising id.
    template <class Visit> void for_each_shown_wall(std::int64_t begin, std::int64_t end, Visit visit) const
    {
        for (std::size_t w = n_bodies_; w < points_.size(); ++w) {
            const std::int64_t n = shown(points_[w]), from = std::max<std::int64_t>(0, begin), to = std::min(end, n);
            if (const Draped* ground = points_[w].draped(); ground && from < to)
                ground->for_each_shown(from, to, [&](std::int64_t k, Vector x) { visit(first_id_[w] + k, x); });
            else
                for (std::int64_t k = from; k < to; ++k) visit(first_id_[w] + k, wall_position(first_id_[w] + k));
            begin -= n, end -= n;
        }
    }
    /// Soil or wall particles in a closed region, counted without visiting them.
    std::int64_t soil_count_in(const Box& region) const;
    std::int64_t wall_count_in(const Box& region) const;

    /// What a closed region holds, as grids; nothing where a shape that is no box has points near it.
    std::optional<std::vector<GridPart>> grids_in(const Box& region) const;

    /// Initial position (m) and body of a soil particle by its id.
    Vector soil_position(std::int64_t id) const;
    int body_of(std::int64_t soil_id) const;
    /// Position (m) and wall of a wall particle by its id.
    Vector wall_position(std::int64_t id) const;
    int wall_of(std::int64_t wall_id) const;

private:
    static std::int64_t shown(const Points& p) { return p.draped() ? p.draped()->shown() : p.size(); }
    struct Survey {
        Issues issues;
        std::vector<std::optional<Points>> points; // bodies, then walls; nothing where a shape cannot be filled
    };
    static Survey survey(const Scene&);
    Filling(const Scene&, Survey);
    std::size_t owner(std::int64_t id) const;

    std::size_t n_bodies_;
    std::vector<Points> points_;         // bodies, then walls
    std::vector<std::int64_t> first_id_; // of every lattice, and the end
    Box soil_bounds_{}, bounds_{};
    double soil_height_ = 0;
};

} // namespace kuzure::scene

namespace kuzure {
using scene::Filling;
}
