#pragma once
// The soil particles of one rank, as a structure of arrays: one array per field component, allocated only if some code
// requires it. Owned particles only; ghosts live as packed records beside it (solver/pairs/record.hpp).
#include "solver/core/ensure.hpp"
#include "solver/core/field.hpp"
#include "solver/core/memory.hpp"
#include "solver/core/tensor.hpp"
#include <array>
#include <cstring>
#include <span>

namespace kuzure {

/// The columns of one field: read or written whole, one particle or V's width of them at a time.
template <Shape S, class T> struct View {
    using Number = std::remove_const_t<T>;
    std::array<T*, std::size_t(S)> column;

    template <class V> KUZURE_INLINE auto load(Index i) const
    {
        return assemble<V>([&](int c) { return kuzure::load<V>(column[c] + i); });
    }
    KUZURE_INLINE auto operator[](Index i) const
    {
        if constexpr (S == Shape::Scalar) return column[0][i];
        else return load<Number>(i);
    }
    template <class A> KUZURE_INLINE void set(Index i, const A& a) const
    {
        spread(a, [&](int c, auto v) { column[c][i] = v; });
    }
    /// The first n lanes of a to particles i .. i+n-1.
    template <class A> KUZURE_INLINE void store(Index i, const A& a, int n) const
    {
        spread(a, [&](int c, auto v) { store_first(column[c] + i, v, n); });
    }

private:
    template <class V, class F> KUZURE_INLINE static auto assemble(F f)
    {
        if constexpr (S == Shape::Scalar) return f(0);
        else if constexpr (S == Shape::Vector) return Vec3<V>{f(0), f(1), f(2)};
        else if constexpr (S == Shape::Symmetric) return Sym3<V>{f(0), f(1), f(2), f(3), f(4), f(5)};
        else return Mat3<V>{{f(0), f(1), f(2)}, {f(3), f(4), f(5)}, {f(6), f(7), f(8)}};
    }
    template <class A, class F> KUZURE_INLINE static void spread(const A& a, F f)
    {
        if constexpr (S == Shape::Scalar) f(0, a);
        else if constexpr (S == Shape::Vector) f(0, a.x), f(1, a.y), f(2, a.z);
        else if constexpr (S == Shape::Symmetric) f(0, a.xx), f(1, a.yy), f(2, a.zz), f(3, a.xy), f(4, a.yz), f(5, a.xz);
        else f(0, a.x.x), f(1, a.x.y), f(2, a.x.z), f(3, a.y.x), f(4, a.y.y), f(5, a.y.z), f(6, a.z.x), f(7, a.z.y), f(8, a.z.z);
    }
};

class Particles {
public:
    /// Slack behind the last particle: a full register may be read there.
    static constexpr Index padding = 16;

    Particles() { require(field::position, field::id); }

    Index size() const { return size_; }

    /// Make sure the columns of these fields exist; new ones are zero.
    template <class... F> void require(F... f) { (require_one(f), ...); }
    template <class F> bool has(F) const { return !columns<F>()[0].empty(); }

    /// Columns of a field that is present. Throws Broken if it was not required.
    template <class F> auto operator[](F) { return view<F, typename F::Number>(*this); }
    template <class F> auto operator[](F) const { return view<F, const typename F::Number>(*this); }

    /// Change the count; new particles are zero in every present field.
    void resize(Index n)
    {
        ensure(n >= 0, "a rank cannot hold a negative number of particles, nor more than 2^31");
        for_each_column([&](auto& column) {
            using T = typename std::remove_reference_t<decltype(column)>::value_type;
            const auto old = std::min(size_, n);
            resize_closely(column, std::size_t(n) + padding);
            std::fill(column.begin() + old, column.end(), T{});
        });
        size_ = n;
    }

    /// New particle k is old particle order[k]; order may be shorter or longer than size().
    void gather(std::span<const Index> order)
    {
        const Index n = Index(order.size());
        const std::size_t length = order.size() + padding;
        for_each_column([&](auto& column) {
            using T = typename std::remove_reference_t<decltype(column)>::value_type;
            resize_anew(spare_, length);
            if constexpr (std::is_same_v<T, double>) {
                put_in_order(column.data(), order, spare_.data());
                column.swap(spare_);
            } else { // there and back: whole numbers have no spare column of their own
                static_assert(sizeof(T) <= sizeof(double) && std::is_trivial_v<T>);
                T* const there = reinterpret_cast<T*>(spare_.data());
                put_in_order(column.data(), order, there);
                resize_anew(column, length);
                std::memcpy(column.data(), there, length * sizeof(T));
            }
        });
        size_ = n;
    }

    /// Bytes of one particle over all present fields.
    std::size_t bytes_per_particle() const
    {
        std::size_t n = 0;
        for_each_present([&](auto f) { n += sizeof(typename decltype(f)::Number) * f.components; });
        return n;
    }
    /// Bytes of all columns, and of the one that is spare.
    std::size_t bytes() const
    {
        std::size_t b = 0;
        for_each_column([&](const auto& c) { b += c.capacity() * sizeof c[0]; });
        return b;
    }
    std::size_t spare_bytes() const { return spare_.capacity() * sizeof(double); }
    /// Append these particles' fields to a byte buffer, particle by particle: the form in which they migrate.
    void pack(std::span<const Index> which, std::vector<std::byte>& out) const
    {
        const std::size_t each = bytes_per_particle(), start = out.size();
        out.resize(start + each * which.size());
        std::byte* to = out.data() + start;
        for (const Index i : which)
            for_each_column([&](const auto& column) {
                std::memcpy(to, &column[i], sizeof column[i]);
                to += sizeof column[i];
            });
    }
    /// Append particles packed by a store with the same fields present. Throws Broken on a size that does not fit.
    void unpack(std::span<const std::byte> in)
    {
        const std::size_t each = bytes_per_particle();
        ensure(in.size() % each == 0, "a message of particles holds a fraction of a particle");
        const Index first = size_, n = Index(in.size() / each);
        resize(first + n);
        const std::byte* from = in.data();
        for (Index i = first; i < first + n; ++i)
            for_each_column([&](auto& column) {
                std::memcpy(&column[i], from, sizeof column[i]);
                from += sizeof column[i];
            });
    }

    /// Calls visit(field) for every present field, in the order of AllFields.
    template <class Visit> void for_each_present(Visit visit) const
    {
        std::apply([&](auto... f) { ((has(f) ? visit(f) : void()), ...); }, AllFields{});
    }

private:
    template <class F> using Columns = std::array<Array<typename F::Number>, F::components>;
    template <class Tuple> struct StorageOf;
    template <class... F> struct StorageOf<std::tuple<F...>> {
        using type = std::tuple<std::pair<F, Columns<F>>...>;
    };

    template <class F> Columns<F>& columns() { return std::get<std::pair<F, Columns<F>>>(storage_).second; }
    template <class F> const Columns<F>& columns() const { return std::get<std::pair<F, Columns<F>>>(storage_).second; }
    template <class F> void require_one(F)
    {
        for (auto& c : columns<F>())
            if (c.empty()) c.assign(std::size_t(size_) + padding, {});
    }
    template <class F, class T, class Self> static View<F::shape, T> view(Self& self)
    {
        View<F::shape, T> v;
        for (int c = 0; c < F::components; ++c) {
            auto& column = self.template columns<F>()[c];
            ensure(!column.empty(), "a loop uses a field that nothing required");
            v.column[c] = column.data();
        }
        return v;
    }
    template <class Visit> void for_each_column(Visit visit)
    {
        for_each_present([&](auto f) {
            for (auto& c : columns<decltype(f)>()) visit(c);
        });
    }
    template <class Visit> void for_each_column(Visit visit) const
    {
        for_each_present([&](auto f) {
            for (const auto& c : columns<decltype(f)>()) visit(c);
        });
    }
    template <class T> static void put_in_order(const T* column, std::span<const Index> order, T* to)
    {
        const Index n = Index(order.size());
#pragma omp parallel for schedule(static) if (n > 4096)
        for (Index k = 0; k < n; ++k) to[k] = column[order[k]];
        // a register that reaches beyond the last particle sees it again: no zero to divide by
        std::fill(to + n, to + n + padding, n > 0 ? to[n - 1] : T{});
    }

    Index size_ = 0;
    StorageOf<AllFields>::type storage_;
    Array<double> spare_; // where gather() puts a column
};

} // namespace kuzure
