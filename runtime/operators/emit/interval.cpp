#include "runtime/operators/emit/interval.h"

#include <fmt/format.h>

#include <cmath>

namespace rapid {

void read_value(const Param& param, const Value& value, Interval& field)
{
    const Table* table = value.table();
    if (!table) {
        if (!value.get<double>()) wrong_type(param, value);
        read_value(param, value, field.min);
        field.max = field.min;
        return;
    }
    if (table->list.size() != 2 || !table->list[0].get<double>() || !table->list[1].get<double>())
        wrong_type(param, value);
    read_value(param, table->list[0], field.min);
    read_value(param, table->list[1], field.max);
    if (field.min > field.max)
        throw Error(
            fmt::format("{} = {} is the wrong way round; it must be {{min, max}}", param.name, describe(value)));
    if (std::isinf(field.max) && !field.is_single())
        throw Error(fmt::format("{} = {} has no mean; both must be finite", param.name, describe(value)));
}

std::string describe(const Interval& interval)
{
    return interval.is_single() ? fmt::format("{}", interval.min)
                                : fmt::format("{{{}, {}}}", interval.min, interval.max);
}

}  // namespace rapid
