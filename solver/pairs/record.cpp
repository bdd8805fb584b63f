#include "solver/pairs/record.hpp"

namespace kuzure {

template <class T>
Record<T> make_record(const FixedPoint<T>& fixed_point, Vector x, Vector v, double volume, double density, const Stress& s, double c)
{
    return {fixed_point(x.x), fixed_point(x.y), fixed_point(x.z), T(v.x),  T(v.y),  T(v.z),  T(volume), T(density),
            T(s.xx),          T(s.yy),          T(s.zz),          T(s.xy), T(s.yz), T(s.xz), T(c),      T(0)};
}
template Record<double> make_record(const FixedPoint<double>&, Vector, Vector, double, double, const Stress&, double);
template Record<float> make_record(const FixedPoint<float>&, Vector, Vector, double, double, const Stress&, double);

} // namespace kuzure
