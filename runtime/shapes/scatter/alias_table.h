// Draws items with probabilities in proportion to their weights, in constant time (Walker 1977, built as in Vose 1991).
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace rapid {

// Each of n equal columns holds the weight of its own item up to `keep`, and that of one other item above it.
class AliasTable {
public:
    AliasTable() = default;
    // weights: at least 0, with a positive sum.
    AliasTable(const std::vector<double>& weights, double sum) : columns_(weights.size())
    {
        std::vector<std::int32_t> small, large;
        for (std::size_t i = 0; i < weights.size(); ++i) {
            columns_[i] = {weights[i] / sum * double(weights.size()), static_cast<std::int32_t>(i)};
            (columns_[i].keep < 1 ? small : large).push_back(static_cast<std::int32_t>(i));
        }
        while (!small.empty() && !large.empty()) {
            Column& filled = columns_[small.back()];
            small.pop_back();
            filled.other = large.back();
            Column& giver = columns_[large.back()];
            giver.keep -= 1 - filled.keep;
            if (giver.keep < 1) {
                small.push_back(large.back());
                large.pop_back();
            }
        }
        // The remaining columns are full up to rounding. None of them has weight 0, because then a column to take from
        // would remain, too.
        for (const std::int32_t i : large) columns_[i].keep = 1;
        for (const std::int32_t i : small)
            if (columns_[i].keep > 0) columns_[i].keep = 1;
    }

    bool empty() const { return columns_.empty(); }

    // Draws an item from two numbers in [0, 1).
    std::int32_t draw(double u, double w) const
    {
        const auto i = static_cast<std::int32_t>(u * double(columns_.size()));
        return w < columns_[i].keep ? i : columns_[i].other;
    }

private:
    struct Column {
        double keep;
        std::int32_t other;
    };
    std::vector<Column> columns_;
};

}  // namespace rapid
