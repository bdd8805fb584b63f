#pragma once
// The parts of a scene that the pair loop is made from: shapes, matter, effects, in SI units and radians. An effect is on
// exactly when its optional has a value, after resolve() has decided what the file left to "auto". Kept apart from Scene,
// whose other keys (output, time, accuracy) may change without compiling the kernels again.
#include "solver/scene/pose.hpp"
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace kuzure::scene {

struct Grid;
class HeightField;

// ---- shapes (solver/scene/shape.hpp knows their geometry) ----
struct Box {
    Vector low, high; // m
    bool operator==(const Box&) const = default;
};
/// Axis along z.
struct Cylinder {
    Vector base; // m
    double radius, height;
    bool operator==(const Cylinder&) const = default;
};
struct Sphere {
    Vector center; // m
    double radius;
    bool operator==(const Sphere&) const = default;
};
/// Closed polygon in x-z, drawn out along y from y[0] to y[1] (ignored in 2-D).
struct Polygon {
    std::vector<std::array<double, 2>> points; // x, z in m
    std::array<double, 2> y{};                 // m
    bool operator==(const Polygon&) const = default;
};
/// How wall particles fill the ground: columns that follow its surface, or the cubic lattice of all other walls, cut by it.
enum class GroundLattice { Draped, Plain };
/// Everything below a height field, down to where no soil can feel it.
struct Ground {
    std::shared_ptr<const HeightField> field; // as wide as the wall
    double depth = 0;                         // m, of the wall particles' layer, along z
    GroundLattice lattice = GroundLattice::Draped;
    std::shared_ptr<const Grid> friction; // rad, Coulomb's; null: the wall's everywhere
    bool operator==(const Ground&) const; // by its heights and friction
};
/// A closed ring of corners in plan, m; the last corner is not the first again.
using Ring = std::vector<std::array<double, 2>>;
/// The mass that fails: soil on a height field within an outline. What its files hold is in `bed`, `rings` and `thicknesses`.
struct Release {
    std::string outline;             // .shp or .geojson, an absolute path; empty: all of the maps
    std::optional<double> thickness; // m along z, everywhere the same
    std::string thickness_map;       // raster of thicknesses, an absolute path
    std::string surface;             // raster of the slip surface, an absolute path
    std::string before, after;       // elevation models before and after, absolute paths
    bool on_top = false;             // the elevation model is the slip surface: soil lies on it

    std::shared_ptr<const HeightField> bed;
    std::vector<Ring> rings;                 // outer rings and holes: inside is what an odd number of them encloses; none: everywhere
    std::shared_ptr<const Grid> thicknesses; // m along z; where it is absent `thickness` counts
    bool operator==(const Release&) const;   // by what it was made from
};
using Shape = std::variant<Box, Cylinder, Sphere, Polygon, Ground, Release>;

// ---- matter ----
enum class Cone { Compression, Extension, PlaneStrain, PlaneStrainNoDilation, Shear };
/// Whether soil remembers the volume that tension at the apex has opened.
enum class OpenedVolume { Kept, Forgotten };

/// Loss of strength with plastic shear. The slip is that across a whole shear band, so the dissipated energy does not
/// depend on the resolution: bands are taken to be one support, 2 h, wide (Bazant & Oh 1983).
struct Softening {
    double cohesion = 0, friction_angle = 0; // residual, Pa and rad
    double slip;                             // m, at which the residual strength is reached
    bool operator==(const Softening&) const = default;
};
/// Friction that grows with the rate of shear, mu(I) = mu_s + (mu_2 - mu_s)/(1 + I_0/I), mu = 3 alpha. Jop, Forterre & Pouliquen (2006).
struct RateFriction {
    double friction_angle;  // rad, of fast flow: mu_2 = 3 alpha of the soil's cone at this angle
    double inertial_number; // I_0
    double grain;           // m, diameter
    double grain_density;   // kg/m^3
    bool operator==(const RateFriction&) const = default;
};

struct Soil {
    std::string name;
    double density;            // kg/m^3
    double young;              // Pa
    double poisson;            // 1
    double cohesion = 0;       // Pa
    double friction_angle = 0; // rad
    double dilation_angle = 0; // rad
    Cone cone = Cone::Compression;
    OpenedVolume opened_volume = OpenedVolume::Kept;
    std::optional<double> tension_cutoff; // Pa, largest mean tension; at most the apex c cot(phi)
    std::optional<double> dilation_decay; // plastic shear strain at which dilation has died out
    std::optional<Softening> softening;
    std::optional<RateFriction> rate_friction;
    bool operator==(const Soil&) const = default;
};

enum class InitialStress { None, AtRest };
struct Body {
    int soil; // index into Scene::soils
    Shape shape;
    Vector velocity{}; // m/s
    InitialStress stress = InitialStress::None;
    std::string name = {}; // empty: none
    bool present = true;   // false before the event that adds it and after the one that removes it
    bool operator==(const Body&) const = default;
};

enum class Surface { Rough, Smooth, Coulomb };
struct Wall {
    Shape shape;
    Surface surface = Surface::Rough;
    double friction_angle = 0; // rad, for Coulomb
    std::string name = {};     // empty: none
    bool present = true;       // as of a body
    Pose pose = {};            // where events have moved it
    double drag = 0;           // beside Coulomb's friction: a traction of rho v^2 times this
    bool operator==(const Wall&) const = default;
};

// ---- effects ----
struct Viscosity {
    double alpha, beta;
    bool operator==(const Viscosity&) const = default;
};
struct ArtificialStress {
    double epsilon = 0.5, exponent = 2.55;
    bool operator==(const ArtificialStress&) const = default;
};
/// Stress diffusion against noise of the spacing's length. Feng et al. (2021).
struct StressDiffusion {
    double zeta = 0.1;
    bool operator==(const StressDiffusion&) const = default;
};
/// Pore water that does not flow: hydrostatic below a water table given by its corners, level beyond the first and last.
struct PorePressure {
    std::vector<std::array<double, 2>> table; // x, z in m, x increasing
    double density = 1000;                    // kg/m^3
    bool operator==(const PorePressure&) const = default;
};
struct Damping {
    double ratio; // of critical, 1
    double until; // s
    bool operator==(const Damping&) const = default;
};
/// Who decides whether an effect is on: the file, or resolve() from the rest of the scene.
enum class Decision { AsWritten, Auto };
struct Effects {
    std::optional<Vector> gravity; // m/s^2
    std::optional<Viscosity> viscosity;
    std::optional<ArtificialStress> artificial_stress;
    Decision artificial_stress_decision = Decision::AsWritten;
    std::optional<StressDiffusion> stress_diffusion;
    Decision stress_diffusion_decision = Decision::AsWritten;
    std::optional<PorePressure> pore_pressure;
    std::optional<Damping> damping;
    bool operator==(const Effects&) const = default;
};
/// One line of the effects list: what is on or off, and why. The name is the scene's key where there is one.
struct EffectNote {
    std::string name, why;
    bool on;
    bool operator==(const EffectNote&) const = default;
};

// ---- what decides between pair models ----
enum class Kernel { CubicSpline, WendlandC2, WendlandC4 };
/// What gradients of linear fields are exact on: particles on their lattice, or infinitely many of them (as published).
enum class KernelNorm { Lattice, Continuum };
enum class Precision { Double, Mixed };
/// Of kernel gradients at free surfaces: in the velocity gradient alone, or in the pair forces too.
enum class Correction { None, Gradient, Adjoint };
/// How a step is made of passes over pairs: Bui's one pass, or the two-pass staggered leap-frog.
enum class Scheme { Staggered, LeapFrog };

/// What a compiled pair model is chosen by and set up with.
struct Interactions {
    int dimensions;
    double spacing, h; // m
    Effects effects;
    Kernel kernel;
    Precision precision;
    Correction correction;
    Scheme scheme = Scheme::Staggered;
    double shifting = 0; // constant of the shifting of particles; 0: none
    KernelNorm norm = KernelNorm::Lattice;
    double hourglass = 0; // strength of the hourglass control; 0: none
};

} // namespace kuzure::scene

namespace kuzure {
struct Scene;
} // namespace kuzure
