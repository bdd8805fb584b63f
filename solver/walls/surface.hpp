#pragma once
// The walls of a scene as one surface: the boundary of the union of all their shapes and of their images across the periods. A
// face that another wall covers or continues is no surface. How the same ground is divided or joined does not show.
#include "solver/scene/scene.hpp"
#include <span>
#include <vector>

namespace kuzure {

/// The tangent plane of the surface nearest to a point inside a wall: the points x with (x - point).normal = depth.
struct Face {
    Vector normal; // out of the wall
    double depth;  // m
    int wall;      // whose contact counts
    Vector side;   // normal of that wall's own face: at an edge, where another wall goes on, not the tangent plane's
    bool tied;     // as near as the one before it among those of its point
    /// Where it touches the surface, seen from the point x, m.
    Vector foot(Vector x) const { return x + depth * normal; }
};
/// What of a force on a face the wall of the face feels; the remainder is felt by the wall of the point behind it, if that is another.
inline Vector own_share(const Face& f, Vector force) { return dot(f.side, f.normal) > 1 - 1e-9 ? force : dot(force, f.side) * f.side; }
/// Velocity of a face from those of walls, velocity(wall, point); x: the point behind it, of the wall `own`. At an edge between two walls
/// each counts the way in which it feels the force.
template <class Velocity> Vector velocity_of(const Face& f, int own, Vector x, Velocity velocity)
{
    const Vector foot = f.foot(x), v = velocity(f.wall, foot);
    if (own == f.wall) return v;
    const Vector other = velocity(own, foot);
    return own_share(f, v) + (other - own_share(f, other));
}

/// So far in front of a face, in smoothing lengths, the face counts fully.
inline constexpr double face_ramp = 0.25;
/// Along which normal a point mirrors a particle, from its faces in their order: that of the nearest face that has the particle in front.
/// What lies less than the ramp in front of it sees the more of the next such face the less it does, so that the normal turns as soil
/// passes the face's plane; a jump there would be a work of the wall, for strain and force are not of the same moment. Faces that are
/// equally near count by how far the particle lies in front of each: behind a straight edge that is the way from the edge to the particle.
/// Nothing of it depends on how the ground is turned. Behind all faces the nearest counts, of equally near ones the least deep.
template <class V> class FacesInFront {
public:
    explicit FacesInFront(V ramp) : ramp_(ramp) {}
    /// `front`: how far the particle lies in front of the face; `tied`: it is as near as the one before. True for the lanes in which it
    /// counts more than any before; the first does.
    KUZURE_INLINE auto add(const Vec3<V>& normal, V front, bool tied)
    {
        const V none(number<V>(0)), in = max(front, none);
        if (!tied) {
            settle();
            first_ = first_ && !begun_, begun_ = true;
        }
        together_ = fma(in, normal, together_), sum_ = sum_ + in;
        const V counts = left_ * (in / (in + ramp_));
        const V weight = first_ ? counts + min(front, none) : select(less(none, in), counts, V(number<V>(-1e30)));
        const auto more = less(most_, weight);
        most_ = select(more, weight, most_);
        return more;
    }
    /// Of unit length; where no face has the particle in front, `otherwise`.
    KUZURE_INLINE Vec3<V> normal(const Vec3<V>& otherwise)
    {
        settle();
        const V square = dot(all_, all_), least(number<V>(1e-12));
        const V scale = V(number<V>(1)) / sqrt(max(square, least));
        return chosen(less(least, square), scale * all_, otherwise);
    }

    template <class M> KUZURE_INLINE static Vec3<V> chosen(M mask, const Vec3<V>& yes, const Vec3<V>& no)
    {
        return {select(mask, yes.x, no.x), select(mask, yes.y, no.y), select(mask, yes.z, no.z)};
    }

private:
    /// The faces up to here are nearer than those to come.
    KUZURE_INLINE void settle()
    {
        const V one(number<V>(1)), tiny(number<V>(1e-30)), share = left_ * min(sum_ / ramp_, one);
        all_ = fma(share / max(sum_, tiny), together_, all_), left_ = left_ - share;
        together_ = {}, sum_ = V(number<V>(0));
    }
    V ramp_, left_ = V(number<V>(1)), sum_ = V(number<V>(0)), most_ = V(number<V>(-1e30));
    Vec3<V> together_{}, all_{};
    bool first_ = true, begun_ = false; // the nearest faces; there were some
};
/// The number of the face that counts most for a particle which lies `front(face)` (m) in front of each.
template <class Front> std::size_t mirroring_face(std::span<const Face> faces, double ramp, Front front)
{
    FacesInFront<double> in_front(ramp);
    std::size_t chosen = 0;
    for (std::size_t k = 0; k < faces.size(); ++k)
        if (in_front.add(faces[k].normal, front(faces[k]), faces[k].tied)) chosen = k;
    return chosen;
}

struct FaceCandidate; // of one shape

class WallSurface {
public:
    /// The walls of the scene, which must outlive it.
    explicit WallSurface(const Scene&);
    /// Exposed faces no further than `reach` from a point inside a wall, nearest first; several where the wall is thin or the point
    /// lies behind a corner.
    void faces(Vector point, double reach, std::vector<Face>& found) const;
    /// Depth of a point below the surface, m; 0 outside all walls.
    double depth(Vector point, double reach) const;

private:
    struct Part {
        int wall;
        Vector shift; // of this image, m
        scene::Box bounds;
        bool moved; // it is not as drawn
    };
    void add(const Part&, Vector x, const FaceCandidate&, double reach, std::vector<Face>& found) const;
    /// A point of space as the part's shape is drawn, m.
    Vector as_drawn(const Part&, Vector x) const;
    /// Where a point lies: in a wall, on the surface of one or between two that touch as far as rounding tells, in the air.
    enum class Side { In, On, Out };
    Side side(Vector x) const;
    /// True where there is air around a point on the surface of what lies beside a face, a little beyond it along `way`; none where two
    /// walls that cover the face touch.
    bool air_around(Vector beyond, Vector way) const;
    /// True where a face goes on from its end along its own plane, with air before it and a wall behind, or this part: else it only touches
    /// the surface.
    bool goes_on(Vector end, Vector normal, const Part* part = nullptr) const;
    /// Has the face at an edge be of the wall with most grip among those whose faces meet there, whichever of them ends there.
    void take_grip(Face&, Vector edge) const;
    /// True where the surface goes on beyond an edge towards a point that sees it along `way`: that is nearer, the edge no face.
    bool continued(Vector edge, Vector way) const;

    const Scene& scene_;
    int dimensions_;
    double tolerance_, rounding_; // m
    std::vector<Part> parts_;
};

/// The exposed faces of many points, no further than `reach` from each.
class PointFaces {
public:
    PointFaces() = default;
    PointFaces(const WallSurface&, std::span<const double> x, std::span<const double> y, std::span<const double> z, double reach);
    std::size_t size() const { return n_; }
    std::span<const Face> operator[](std::size_t point) const
    {
        const Part& p = parts_[point / share_];
        const std::size_t k = point % share_;
        return {p.faces.data() + p.first[k], p.faces.data() + p.first[k + 1]};
    }
    /// Of all points.
    std::size_t faces() const;
    std::size_t bytes() const;

private:
    struct Part { // made by one thread
        std::vector<Index> first;
        std::vector<Face> faces;
    };
    std::size_t n_ = 0, share_ = 1; // points, in all and in a part
    std::vector<Part> parts_;
};

} // namespace kuzure
