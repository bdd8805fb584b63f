#pragma once
// The staggered leap-frog: two passes a step, stable to dt c_p/h of about 1.8 where one pass ends at 0.3. Between steps the state is
// that of time t^n: x, v, sigma, rho, and the acceleration a^n. A step of length dt is
//
//     v^{n+1/2} = v^n + dt/2 a^n,  x^{n+1} = x^n + dt v^{n+1/2}                                       move
//     L = grad v^{n+1/2} at the positions of mid-step; rho, sigma -> n+1; viscous force                  stage 0, "strain"
//     a^{n+1} from sigma^{n+1} at x^{n+1} and that viscous force;  v^{n+1} = v^{n+1/2} + dt/2 a^{n+1}  stage 1, "force"
//
// The geometry of L must be that of mid-step: at x^{n+1} it makes an energy error of (dt/2) sigma : L.L, first order. A stage reads of
// neighbours only what the other one wrote, strain the kinematics and force the stresses beside positions, so no record is
// buffered twice. The work of a force between t^n and t^{n+1} is (F^n + F^{n+1})/2 . v^{n+1/2} dt: the half of F^n that comes after
// t^n is booked as `later`, with the length of the step to come, which is decided one step ahead.
#include "solver/kernels/affine_motion.hpp"
#include "solver/kernels/force.hpp"
#include "solver/kernels/strain.hpp"

namespace kuzure {

template <class M, class V, class Law = MirrorImage>
class Staggered : public ForceStage<StrainStage<AffineMotion<StaggeredRecords<M, V, Law>>>> {
    using Base = ForceStage<StrainStage<AffineMotion<StaggeredRecords<M, V, Law>>>>;

public:
    explicit Staggered(const scene::Interactions& s) : Base(s), stages_{Base::strain_stage(), Base::force_stage()} {}
    std::string name() const override { return "staggered, " + Base::lanes_name(); }
    std::span<const Stage> stages() const override { return stages_; }
    std::size_t record_bytes() const override { return stages_[0].ghost_bytes + stages_[1].ghost_bytes; }
    PassResult run(int stage, const StepInput& in, std::span<const Index> clusters) override
    {
        return stage == 0 ? Base::run_strain(in, clusters) : Base::run_force(in, clusters);
    }

private:
    Stage stages_[2];
};

} // namespace kuzure
