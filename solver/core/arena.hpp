#pragma once
// Many short lists one behind the other, in pieces of memory that stay where they are: no list moves when the next one comes, none is
// copied while they grow, and little more is held than they take.
#include "solver/core/memory.hpp"
#include <algorithm>

namespace kuzure {

template <class T> class Arena {
public:
    /// Forgets all lists, and gives back what they did not take of its pieces. `expected`: items to come, about.
    void clear(std::size_t expected)
    {
        pieces_.resize(std::min(pieces_.size(), at_ + 1));
        at_ = 0, used_ = 0, taken_ = 0;
        // A large one is just a huge page with what HugePages puts in front of it; a small one an eighth of them all.
        constexpr std::size_t huge = (std::size_t(1) << 21) - 8192;
        const std::size_t eighth = expected * sizeof(T) / 8;
        piece_ = (eighth >= huge / 2 ? huge : std::max<std::size_t>(eighth, 4096)) / sizeof(T);
    }
    /// Room for n items behind those taken, until the next call.
    T* room(std::size_t n)
    {
        if (pieces_.empty()) return grow(n);
        while (used_ + n > pieces_[at_].size()) {
            if (at_ + 1 == pieces_.size()) return grow(n);
            ++at_, used_ = 0;
        }
        return pieces_[at_].data() + used_;
    }
    /// The first n of that room are a list.
    void take(std::size_t n) { used_ += n, taken_ += n; }

    /// Items of all lists.
    std::size_t taken() const { return taken_; }
    std::size_t bytes() const
    {
        std::size_t b = 0;
        for (const auto& p : pieces_) b += p.capacity() * sizeof(T);
        return b;
    }

private:
    T* grow(std::size_t n)
    {
        pieces_.emplace_back(std::max(piece_, n));
        at_ = pieces_.size() - 1, used_ = 0;
        return pieces_[at_].data();
    }

    std::vector<Array<T>> pieces_;
    std::size_t piece_ = 4096 / sizeof(T);
    std::size_t at_ = 0, used_ = 0, taken_ = 0; // piece that is being filled, items in it, in all
};

} // namespace kuzure
