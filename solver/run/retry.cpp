// The state to which a retry goes back, and the way there: the part of Simulation behind time.retry.
#include "solver/run/simulation.hpp"

namespace kuzure {

void Simulation::remember_if_good(bool rebuilt)
{
    if (!options_.guard || !rebuilt) return;
    if (clock_.step - clock_.inspected < 64) return;
    timers_.timed(Phase::Guard, [&] {
        clock_.inspected = clock_.step;
        watch_.inspect(particles_, layout_, clock_, ledger());
        remember();
    });
}

void Simulation::remember()
{
    if (options_.guard && scene_.time.retry) last_good_ = SavedState{particles_, clock_, work_, domain_.known()};
}

bool Simulation::roll_back()
{
    if (!last_good_ || clock_.time <= last_failure_time_) return false;
    last_failure_time_ = clock_.time;
    particles_ = last_good_->particles;
    clock_ = last_good_->clock;
    work_ = last_good_->work;
    clock_.base_time = clock_.time, clock_.base_step = clock_.step;
    clock_.step_scale *= 0.5;
    if (!start_scene_.events.empty()) {
        enter_stage(clock_.time);
        layout_.forget();
        happened_.resize(std::size_t(clock_.events - events_before_));
    }
    // Cuts since then have moved blocks on, further than a rank knows.
    domain_.restore_owners(last_good_->known);
    domain_.migrate(particles_);
    rebuild(false, clock_.time);
    if (model_->moves_first()) clock_.next = step_length(scene_, clock_);
    return true;
}

} // namespace kuzure
