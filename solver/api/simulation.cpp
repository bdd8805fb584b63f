#include "solver/api/simulation.hpp"
#include "io/hdf5.hpp"
#include "io/scene_file.hpp"
#include "solver/core/bulk_density.hpp"
#include "solver/run/simulation.hpp"
#include <fmt/format.h>

namespace kuzure::api {

// ---- ranks ----------------------------------------------------------------------------------------------------------
struct Ranks::Inside {
    std::optional<Environment> environment;
};

Ranks::Ranks(int& argc, char**& argv) : inside_(std::make_unique<Inside>())
{
    io::quiet_hdf5(); // before MPI
    if (launched()) inside_->environment.emplace(argc, argv);
    else inside_->environment.emplace();
}
Ranks::~Ranks() = default;
int Ranks::rank() const { return Comm::world().rank(); }
int Ranks::size() const { return Comm::world().size(); }

// ---- scene ----------------------------------------------------------------------------------------------------------
struct Scene::Inside {
    std::string original, name;
    std::vector<std::string> sets;
    scene::CheckedScene checked;
};

Scene::Scene(std::shared_ptr<const Inside> inside) : inside_(std::move(inside)) {}

Scene Scene::read(const std::string& file, const std::vector<std::string>& sets) { return parse(io::read_scene_text(file), sets, file); }

Scene Scene::parse(std::string_view text, const std::vector<std::string>& sets, const std::string& name)
{
    auto checked = io::parse_checked_scene(text, name, sets, scene::StepLimit::Enforce);
    return Scene(std::make_shared<const Inside>(Inside{std::string(text), name, sets, std::move(checked)}));
}

Scene Scene::with(const std::string& key, double value) const
{
    auto sets = inside_->sets;
    sets.push_back(fmt::format("{}={}", key, value));
    return parse(inside_->original, sets, inside_->name);
}

std::string Scene::text() const { return io::write_scene(inside_->checked.scene); }

std::vector<std::string> Scene::warnings() const
{
    std::vector<std::string> words;
    for (const auto& issue : inside_->checked.warnings) words.push_back(in_words(issue));
    return words;
}

double Scene::spacing() const { return inside_->checked.scene.space.spacing; }
double Scene::particle_volume() const { return inside_->checked.scene.particle_volume(); }
double Scene::end() const { return inside_->checked.scene.time.end; }

std::vector<std::string> Scene::soils() const
{
    std::vector<std::string> names;
    for (const auto& soil : inside_->checked.scene.soils) names.push_back(soil.name);
    return names;
}

// ---- simulation -----------------------------------------------------------------------------------------------------
namespace {

Vector vector(const kuzure::Vector& v) { return {v.x, v.y, v.z}; }

/// What only the program reads.
const kuzure::Scene& without_another_run(const kuzure::Scene& s)
{
    if (!s.start.from.empty()) throw BadInput("start.from: another run's state is read by kuzure run alone");
    return s;
}

RunOptions with_filling(const scene::Filling& filling)
{
    RunOptions options;
    options.filling = filling;
    return options;
}

} // namespace

double Energies::sum() const
{
    return kinetic + potential + elastic + plastic + viscous + wall + damping + stabilising + moved_wall + events + loads;
}

struct Simulation::Inside {
    kuzure::Simulation run;
};

Simulation::Simulation(const Ranks&, const Scene& s)
    : inside_(new Inside{{Comm::world(), without_another_run(s.inside_->checked.scene), with_filling(s.inside_->checked.filling)}})
{
}
Simulation::~Simulation() = default;

void Simulation::step()
{
    try {
        inside_->run.step();
    } catch (const NumbersFailed&) { // on every rank together
        if (!inside_->run.roll_back()) throw;
    }
}

void Simulation::run(double until)
{
    while (!finished() && time() < until) step();
}

bool Simulation::finished() const { return inside_->run.finished(); }
double Simulation::time() const { return inside_->run.time(); }
std::int64_t Simulation::steps() const { return inside_->run.steps(); }
double Simulation::max_speed() const { return inside_->run.max_speed(); }

std::vector<Particle> Simulation::particles() const
{
    const Particles& p = inside_->run.particles();
    const auto id = p[field::id];
    const auto soil = p[field::soil];
    const auto position = p[field::position], origin = p[field::origin], velocity = p[field::velocity];
    const auto plastic_strain = p[field::plastic_strain];
    const auto stress = p[field::stress];
    std::vector<Particle> all(std::size_t(p.size()));
    for (Index i = 0; i < p.size(); ++i) {
        const kuzure::Stress s = stress[i];
        all[std::size_t(i)] = {id[i],
                               soil[i],
                               vector(position[i]),
                               vector(position[i] - origin[i]),
                               vector(velocity[i]),
                               bulk_density(p, i),
                               {s.xx, s.yy, s.zz, s.xy, s.yz, s.xz},
                               plastic_strain[i]};
    }
    return all;
}

std::int64_t Simulation::count() const { return inside_->run.comm().sum(std::int64_t(inside_->run.particles().size())); }

Energies Simulation::energies() const
{
    const Ledger now = inside_->run.ledger();
    const EnergySums& taken = now.dissipated;
    return {now.state.kinetic, now.state.potential, now.state.elastic, taken.plastic, taken.viscous, taken.wall,
            taken.damping,     taken.stabilising,   taken.moved_wall,  now.events,    taken.loads};
}

std::string Simulation::state_hash() const { return kuzure::state_hash(inside_->run.comm(), inside_->run.particles()); }

} // namespace kuzure::api
