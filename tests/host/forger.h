// Builds states with values that no run would store, reproducibly from a seed.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <random>
#include <variant>
#include <vector>

#include "runtime/points/saved_state.h"

namespace rapid::test {

class Forger {
public:
    explicit Forger(std::uint64_t seed) : random_(seed) {}

    // Changes some values of a state, in its bytes or in its columns.
    SavedState operator()(SavedState state)
    {
        for (std::size_t left = 1 + below(4); left > 0; --left)
            if (state.columns.empty() || below(3) > 0)
                change_bytes(state.bytes);
            else
                std::visit([&](auto& column) { change(column); }, state.columns[below(state.columns.size())]);
        return state;
    }

private:
    std::size_t below(std::size_t n) { return n == 0 ? 0 : static_cast<std::size_t>(random_() % n); }

    // Returns values that are likely to cause harm: counts, indices and ids out of range, and NaN.
    std::uint64_t word()
    {
        static constexpr std::uint64_t words[] = {0,
                                                  1,
                                                  2,
                                                  0xff,
                                                  0xffff,
                                                  0x7fffffff,
                                                  0x80000000,
                                                  0xffffffff,
                                                  0x7fffffffffffffff,
                                                  0x8000000000000000,
                                                  ~std::uint64_t{0},
                                                  0x7fc000007fc00000,   // floats: NaN
                                                  0x7f8000007f800000,   // infinite
                                                  0x7149f2ca7149f2ca,   // 1e30
                                                  0x7ff8000000000000,   // doubles: NaN
                                                  0x7ff0000000000000,   // infinite
                                                  0x46293e5939a08cea,   // 1e30
                                                  0xbff0000000000000};  // -1
        const std::size_t k = below(std::size(words) + 4);
        return k < std::size(words) ? words[k] : below(k % 2 ? 16 : 100000);
    }

    void change_bytes(std::vector<char>& bytes)
    {
        if (bytes.empty()) return;
        const std::size_t at = below(bytes.size()), size = std::size_t{1} << below(4);
        const std::uint64_t value = word();
        switch (below(8)) {
            case 0:
                bytes[at] = static_cast<char>(bytes[at] ^ 1 << below(8));
                break;
            case 1:
                bytes[at] = static_cast<char>(bytes[at] + (below(2) ? 1 : -1));
                break;
            case 2:  // a copy of other bytes
                std::copy_n(
                    bytes.begin() + static_cast<std::ptrdiff_t>(below(bytes.size() - std::min(size, bytes.size()) + 1)),
                    std::min(size, bytes.size() - at), bytes.begin() + static_cast<std::ptrdiff_t>(at));
                break;
            default:
                std::memcpy(bytes.data() + at, &value, std::min(size, bytes.size() - at));
        }
    }

    template <class T>
    void change(Column<T>& column)
    {
        if (column.size() == 0) return;
        const std::uint64_t values[] = {word(), word()};
        const std::size_t place = below(column.size());
        switch (below(8)) {
            case 0:
                column = Column<T>(column.size() + 1 - 2 * below(2));
                break;
            case 1:
                column.write()[place] = column[below(column.size())];
                break;
            default:
                std::memcpy(static_cast<void*>(&column.write()[place]), values, std::min(sizeof(T), sizeof values));
        }
    }

    std::mt19937_64 random_;
};

}  // namespace rapid::test
