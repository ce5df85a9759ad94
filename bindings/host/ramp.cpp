#include "bindings/host/ramp.h"

#include <fmt/format.h>

namespace rapid {

std::shared_ptr<const Ramp> read_ramp(const Param& param, const Value& value)
{
    const auto refuse = [&](const std::string& what) {
        throw Error(
            fmt::format("{} {}; it must be a list of keys with increasing positions and values of one type, such as {{ "
                        "{{0, 1}}, {{0.5, 4}} }} or {{ {{0, {{1, 0, 0}}}} }}",
                        param.name, what));
    };
    const Table* table = value.table();
    if (!table || table->list.empty() || !table->named.empty() || !table->numbered.empty())
        refuse("= " + describe(value));

    auto ramp = std::make_shared<Ramp>();
    for (const Value& key : table->list) {
        const Table* pair = key.table();
        const double* position = pair && pair->list.size() == 2 ? pair->list[0].get<double>() : nullptr;
        if (!position || !std::isfinite(*position)) refuse("has the key " + describe(key));
        if (!ramp->keys.empty() && !(*position > ramp->keys.back().first))
            refuse(fmt::format("has the position {:g} after {:g}", *position, ramp->keys.back().first));
        Value kept;
        if (pair->list[1].get<double>()) {
            double number = 0;
            read_value(param, pair->list[1], number);
            kept = Value(number);
        } else {
            Vec3d vector;
            read_value(param, pair->list[1], vector);
            kept = Value(vector);
        }
        if (!ramp->keys.empty() && ramp->keys.back().second.index() != kept.index())
            refuse("has both numbers and vec3s as values");
        ramp->keys.emplace_back(*position, std::move(kept));
    }
    return ramp;
}

}  // namespace rapid
