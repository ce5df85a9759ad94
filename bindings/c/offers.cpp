// Offers in C: arrays are copied, callbacks are wrapped.
#include <cstring>

#include "bindings/c/interface.h"

namespace rapid {
namespace {

// Throws if a callback's status is not 0.
void expect_done(int status)
{
    if (status != 0) throw std::runtime_error(fmt::format("it returned {}; it must return 0 for success", status));
}

HostShape shape_of(const rapid_shape& given, std::shared_ptr<const OffersEnd> end)
{
    if (!given.distance) refuse("shape->distance is NULL");
    HostShape shape;
    std::copy_n(given.lower, 3, shape.lower.begin());
    std::copy_n(given.upper, 3, shape.upper.begin());
    shape.slope_bound = given.slope_bound == 0 ? 1 : given.slope_bound;
    shape.smallest_feature = given.smallest_feature;
    shape.distance = [call = given.distance, user = given.user, end = std::move(end)](std::size_t n, const double* P,
                                                                                      double* phi, double* gradient) {
        expect_done(call(user, n, P, phi, gradient));
    };
    return shape;
}

HostParameter parameter_of(const rapid_node_parameter& given)
{
    HostParameter parameter;
    parameter.name = &not_null(given.name, "a parameter's name");
    parameter.doc = given.doc ? given.doc : "";
    parameter.unit = given.unit ? given.unit : "";
    const SceneValue fallback = value_of(given.fallback, parameter.name);
    if (const auto* number = std::get_if<double>(&fallback))
        parameter.fallback = *number;
    else if (const auto* vector = std::get_if<std::array<double, 3>>(&fallback))
        parameter.fallback = *vector;
    else
        refuse(fmt::format("{}: the parameters of nodes are RAPID_NUMBER or RAPID_VEC3", parameter.name));
    return parameter;
}

ColumnType column_type_of(int type, const std::string& name)
{
    if (type < RAPID_FLOAT || type > RAPID_STRING)
        refuse(fmt::format("{}: its type is {}; it must be RAPID_FLOAT to RAPID_STRING", name, type));
    return static_cast<ColumnType>(type);
}

std::size_t bytes_of(ColumnType type)
{
    constexpr std::size_t bytes[] = {4, 12, 4, 8, 16, 1, 4};  // in the order of the types
    return bytes[static_cast<int>(type)];
}

// Checks a count of points or triangles, of which none takes more than 16 bytes per column. Throws Error if the size
// exceeds an address.
void check_count(std::size_t count, const char* name)
{
    constexpr std::size_t most = SIZE_MAX / 64;
    if (count > most) refuse(fmt::format("{} = {} is more than memory can hold", name, count));
}

// Returns the values of a column, packed.
std::shared_ptr<std::vector<char>> copied(const rapid_column& column, std::size_t bytes, std::size_t count)
{
    auto copy = std::make_shared<std::vector<char>>(bytes * count);
    const std::size_t stride = column.stride == 0 ? bytes : column.stride;
    for (std::size_t i = 0; i < count; ++i)
        std::memcpy(copy->data() + i * bytes, static_cast<const char*>(column.data) + i * stride, bytes);
    return copy;
}

std::vector<std::pair<std::string, ColumnType>> columns_of(const rapid_node_column* given, std::size_t count)
{
    std::vector<std::pair<std::string, ColumnType>> columns;
    if (count > 0) not_null(given, "the columns of a node");
    for (std::size_t i = 0; i < count; ++i) {
        const std::string name = &not_null(given[i].name, "a column's name");
        columns.emplace_back(name, column_type_of(given[i].type, name));
    }
    return columns;
}

HostNode node_of(const rapid_node_type& given, std::shared_ptr<const OffersEnd> end)
{
    if (!given.call) refuse("type->call is NULL");
    HostNode node;
    node.name = &not_null(given.name, "type->name");
    node.doc = given.doc ? given.doc : "";
    if (given.kind < RAPID_FORCE || given.kind > RAPID_CONSTRAINT)
        refuse(fmt::format("type->kind = {}; it must be RAPID_FORCE, RAPID_EDIT or RAPID_CONSTRAINT", given.kind));
    node.kind = static_cast<HostNode::Kind>(given.kind);
    if (given.parameter_count > 0) not_null(given.parameters, "type->parameters");
    for (std::size_t i = 0; i < given.parameter_count; ++i)
        node.parameters.push_back(parameter_of(given.parameters[i]));
    node.reads = columns_of(given.reads, given.read_count);
    node.writes = columns_of(given.writes, given.write_count);
    node.call = [call = given.call, user = given.user, end = std::move(end)](const HostCall& now) {
        const rapid_call in_c{now.count,        now.frame, now.time,   now.dt,   now.parameters, now.P,   now.v,
                              now.acceleration, now.reads, now.writes, now.kill, now.id,         now.rods};
        expect_done(call(user, &in_c));
    };
    return node;
}

int add(rapid_offers* offers, const char* name, rapid_error** error, const auto& make)
{
    return guarded(error, [&] {
        const auto open = open_offers(offers);
        const std::string key = &not_null(name, "name");
        HostObject object = make(*open);
        const std::lock_guard lock(open->mutex);
        open->objects.emplace_back(key, std::move(object));
    });
}

}  // namespace
}  // namespace rapid

using namespace rapid;

extern "C" {

int rapid_offers_new(rapid_offers** offers, rapid_error** error)
{
    return guarded(error, [&] {
        not_null(offers, "offers") = nullptr;
        *offers = static_cast<rapid_offers*>(AllOffers::add(std::make_shared<OpenOffers>()));
    });
}

int rapid_offers_guard(rapid_offers* offers, int guard, rapid_error** error)
{
    return guarded(error, [&] {
        const auto open = open_offers(offers);
        const std::lock_guard lock(open->mutex);
        open->guard = guard != 0;
    });
}

int rapid_offers_on_release(rapid_offers* offers, void (*release)(void* user), void* user, rapid_error** error)
{
    return guarded(error, [&] {
        const auto open = open_offers(offers);
        if (!release) refuse("release is NULL");
        const std::lock_guard lock(open->mutex);
        open->end->calls.emplace_back(release, user);
    });
}

int rapid_offers_mesh(rapid_offers* offers, const char* name, const float* positions, size_t count,
                      const int32_t* triangles, size_t triangle_count, rapid_error** error)
{
    return add(offers, name, error, [&](const OpenOffers&) {
        check_count(count, "count");
        check_count(triangle_count, "triangle_count");
        HostMesh mesh;
        mesh.positions.resize(count);
        mesh.triangles.resize(triangle_count);
        if (count > 0) std::memcpy(mesh.positions.data(), &not_null(positions, "positions"), 12 * count);
        if (triangle_count > 0)
            std::memcpy(mesh.triangles.data(), &not_null(triangles, "triangles"), 12 * triangle_count);
        return mesh;
    });
}

int rapid_offers_points(rapid_offers* offers, const char* name, size_t count, const rapid_column* columns,
                        size_t column_count, rapid_error** error)
{
    return guarded(error, [&] {
        const auto open = open_offers(offers);
        const std::string key = &not_null(name, "name");
        check_count(count, "count");
        if (column_count > 0) not_null(columns, "columns");
        HostPoints points;
        points.count = count;
        for (std::size_t i = 0; i < column_count; ++i) {
            const std::string column = &not_null(columns[i].name, "a column's name");
            const ColumnType type = column_type_of(columns[i].type, column);
            if (count > 0) not_null(static_cast<const char*>(columns[i].data), ("the data of " + column).c_str());
            const auto copy = copied(columns[i], bytes_of(type), count);
            points.columns.push_back({column, type, copy->data(), 0, copy});
        }
        const std::lock_guard lock(open->mutex);
        open->objects.emplace_back(key, std::move(points));
    });
}

int rapid_offers_shape(rapid_offers* offers, const char* name, const rapid_shape* shape, rapid_error** error)
{
    return add(offers, name, error,
               [&](const OpenOffers& open) { return shape_of(known_part(shape, "shape"), open.end); });
}

int rapid_offers_node(rapid_offers* offers, const rapid_node_type* type, rapid_error** error)
{
    return guarded(error, [&] {
        const auto open = open_offers(offers);
        HostNode node = node_of(known_part(type, "type"), open->end);
        const std::lock_guard lock(open->mutex);
        open->nodes.push_back(std::move(node));
    });
}

int rapid_call_add_rod(const rapid_call* call, int64_t a, int64_t b, double length, double compliance,
                       rapid_error** error)
{
    return guarded(error, [&] {
        if (!not_null(call, "call").rods) refuse("the call does not belong to a constraint, so it takes no rods");
        static_cast<std::vector<HostRod>*>(call->rods)->push_back({a, b, length, compliance});
    });
}

int rapid_offers_release(rapid_offers* offers, rapid_error** error)
{
    return guarded(error, [&] {
        open_offers(offers);
        AllOffers::remove(offers);
    });
}

}  // extern "C"
