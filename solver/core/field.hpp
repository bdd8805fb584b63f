#pragma once
// Every quantity a soil particle can carry, declared once: name, unit, shape, number type. The store allocates it,
// migration sends it, HDF5 writes it and the memory estimate counts it from this one line.
#include <algorithm>
#include <cstdint>
#include <string_view>
#include <tuple>

namespace kuzure {

template <std::size_t N> struct Text {
    char chars[N]{};
    consteval Text(const char (&s)[N]) { std::copy_n(s, N, chars); }
};
enum class Shape { Scalar = 1, Vector = 3, Symmetric = 6, Matrix = 9 };

template <Text Name, Text Unit, Shape S, class T = double> struct Field {
    static constexpr std::string_view name = Name.chars;
    static constexpr std::string_view unit = Unit.chars;
    static constexpr Shape shape = S;
    static constexpr int components = int(S);
    using Number = T;
};

namespace field {
// State at the step's time t: what snapshots show. Density is that of the soil between what has opened (core/bulk_density.hpp: with it).
inline constexpr struct Position : Field<"position", "m", Shape::Vector> {
} position;
inline constexpr struct Velocity : Field<"velocity", "m/s", Shape::Vector> {
} velocity;
inline constexpr struct Density : Field<"density", "kg/m^3", Shape::Scalar> {
} density;
inline constexpr struct Stress : Field<"stress", "Pa", Shape::Symmetric> {
} stress;
inline constexpr struct PlasticStrain : Field<"plastic_strain", "1", Shape::Scalar> {
} plastic_strain;
// Only where a soil remembers: volume strain that tension at the apex has opened.
inline constexpr struct OpenedVolume : Field<"opened_volume", "1", Shape::Scalar> {
} opened_volume;
// Of the staggered scheme, at t: what the next half kick needs; the stress rate of diffusion and shifting, for the next strain.
inline constexpr struct Acceleration : Field<"acceleration", "m/s^2", Shape::Vector> {
} acceleration;
inline constexpr struct StressRate : Field<"stress_rate", "Pa/s", Shape::Symmetric> {
} stress_rate;
// Only where pair forces are by corrected gradients: the correction that they take, and that of the strain before (M^-1).
inline constexpr struct GradientMatrix : Field<"gradient_matrix", "1", Shape::Symmetric> {
} gradient_matrix;
inline constexpr struct StrainMatrix : Field<"strain_matrix", "1", Shape::Symmetric> {
} strain_matrix;
// Only where particles are shifted: the velocity at which they are beside their own, and what that changes of their own.
inline constexpr struct Shift : Field<"shift", "m/s", Shape::Vector> {
} shift;
inline constexpr struct ShiftAcceleration : Field<"shift_acceleration", "m/s^2", Shape::Vector> {
} shift_acceleration;
// Only where there are Coulomb walls: elastic slip, the acceleration by which a wall holds the particle (0: no contact), and the most
// that friction carries.
inline constexpr struct WallSlip : Field<"wall_slip", "m", Shape::Vector> {
} wall_slip;
inline constexpr struct WallPressure : Field<"wall_pressure", "m/s^2", Shape::Scalar> {
} wall_pressure;
inline constexpr struct WallFriction : Field<"wall_friction", "m/s^2", Shape::Scalar> {
} wall_friction;
// Only where forces on walls are told: acceleration by all walls together.
inline constexpr struct WallForce : Field<"wall_force", "m/s^2", Shape::Vector> {
} wall_force;
// Only where the scene has loads: the number of the load that pushes the particle, from 1 (0: none), and its force with all of it.
inline constexpr struct Load : Field<"load", "1", Shape::Scalar, std::int32_t> {
} load;
inline constexpr struct LoadPush : Field<"load_push", "N", Shape::Vector> {
} load_push;
// Only where a load has a plate: acceleration by all forces whose work no energy stores (viscous, artificial, of walls and loads).
inline constexpr struct Unstored : Field<"unstored", "m/s^2", Shape::Vector> {
} unstored;
// State half a step earlier: what Bui's leap-frog advances.
inline constexpr struct HalfVelocity : Field<"half_step_velocity", "m/s", Shape::Vector> {
} half_velocity;
inline constexpr struct HalfDensity : Field<"half_step_density", "kg/m^3", Shape::Scalar> {
} half_density;
inline constexpr struct HalfStress : Field<"half_step_stress", "Pa", Shape::Symmetric> {
} half_stress;
// Where the particle was at the last sort (its position in the global order) and at t = 0 (its displacement).
inline constexpr struct SortedPosition : Field<"sorted_position", "m", Shape::Vector> {
} sorted_position;
inline constexpr struct Origin : Field<"origin", "m", Shape::Vector> {
} origin;
inline constexpr struct Id : Field<"id", "1", Shape::Scalar, std::int64_t> {
} id;
inline constexpr struct Soil : Field<"soil", "1", Shape::Scalar, std::int32_t> {
} soil;
// Only where soil may sleep (accuracy.sleep_below): a value of Activity.
inline constexpr struct Activity : Field<"activity", "1", Shape::Scalar, std::int32_t> {
} activity;
} // namespace field

/// Of field::activity: moves, or is about to; calm; asleep, its state kept until soil is looked at again.
enum class Activity : std::int32_t { Moves = 0, Calm = 1, Asleep = 2 };

using AllFields = std::tuple<field::Position, field::Velocity, field::Density, field::Stress, field::PlasticStrain, field::OpenedVolume,
                             field::Acceleration, field::StressRate, field::GradientMatrix, field::StrainMatrix, field::Shift,
                             field::ShiftAcceleration, field::WallSlip, field::WallPressure, field::WallFriction, field::WallForce,
                             field::Load, field::LoadPush, field::Unstored, field::HalfVelocity, field::HalfDensity, field::HalfStress,
                             field::SortedPosition, field::Origin, field::Id, field::Soil, field::Activity>;

} // namespace kuzure
