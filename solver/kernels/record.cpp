#include "solver/kernels/step.hpp"

namespace kuzure {

template <class T>
Record<T> make_record(const Places<T>& place, Vector x, Vector v, double volume, double density, const Stress& s, double c)
{
    return {place(x.x), place(x.y), place(x.z), T(v.x),  T(v.y),  T(v.z),  T(volume), T(density),
            T(s.xx),    T(s.yy),    T(s.zz),    T(s.xy), T(s.yz), T(s.xz), T(c),      T(0)};
}
template Record<double> make_record(const Places<double>&, Vector, Vector, double, double, const Stress&, double);
template Record<float> make_record(const Places<float>&, Vector, Vector, double, double, const Stress&, double);

template <class T> Tension<T> make_tension(const Stress& s, double epsilon)
{
    const Stress t = tension(s, epsilon);
    const bool any = t != Stress{};
    return {T(t.xx), T(t.yy), T(t.zz), T(t.xy), T(t.yz), T(t.xz), T(any), T(0)};
}
template Tension<double> make_tension(const Stress&, double);
template Tension<float> make_tension(const Stress&, double);

} // namespace kuzure
