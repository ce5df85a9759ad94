#include "runtime/shapes/mesh/gltf_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <span>

#include "runtime/base/error.h"
#include "runtime/base/json.h"
#include "runtime/base/memory_budget.h"
#include "runtime/files/base64.h"
#include "runtime/files/input_file.h"
#include "runtime/files/scalars.h"
#include "runtime/files/skipped_contents.h"

namespace rapid {
namespace {

using json = SortedCheckedJson;
using Bytes = std::vector<unsigned char>;

constexpr std::uint32_t binary_mark = 0x46546c67;  // "glTF"
constexpr std::uint32_t json_chunk = 0x4e4f534a, binary_chunk = 0x004e4942;

struct Component {
    int number;
    ScalarType type;
    double largest;  // the largest value, if normalized
};
constexpr Component components[] = {
    {5120, ScalarType::Int8, 127},     {5121, ScalarType::UInt8, 255},  {5122, ScalarType::Int16, 32767},
    {5123, ScalarType::UInt16, 65535}, {5125, ScalarType::UInt32, 1.0}, {5126, ScalarType::Float, 1.0},
};

const Component& component_of(int number)
{
    const auto found = std::find_if(std::begin(components), std::end(components),
                                    [&](const Component& component) { return component.number == number; });
    if (found == std::end(components)) throw Error(fmt::format("an accessor has the unknown type {}", number));
    return *found;
}

// Extensions that change nothing of what is read, or that are read.
bool can_read(const std::string& extension)
{
    for (const char* known : {"KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_", "KHR_lights_"})
        if (extension.starts_with(known)) return true;
    static const std::set<std::string> others = {"KHR_mesh_quantization", "EXT_mesh_gpu_instancing",
                                                 "KHR_technique_webgl", "KHR_techniques_webgl"};
    return others.count(extension) > 0;
}

// Decodes the escapes %XX of a URI.
std::string from_uri(std::string_view uri)
{
    std::string path;
    for (std::size_t at = 0; at < uri.size(); ++at) {
        unsigned char byte = 0;
        const char* const digits = uri.data() + at + 1;
        if (uri[at] == '%' && at + 3 <= uri.size() && std::from_chars(digits, digits + 2, byte, 16).ptr == digits + 2) {
            path += static_cast<char>(byte);
            at += 2;
        } else {
            path += uri[at];
        }
    }
    return path;
}

const json& element(const json& list, const char* what, const json& index)
{
    const auto number = index.get<std::int64_t>();
    if (number < 0 || static_cast<std::size_t>(number) >= list.size())
        throw Error(fmt::format("it refers to {} {}; there are {}, numbered from 0", what, number, list.size()));
    return list.at(static_cast<std::size_t>(number));
}

// The values of an accessor: shape [count, numbers].
struct Values {
    std::size_t count = 0, numbers = 1;
    std::vector<double> all;

    const double* operator[](std::size_t i) const { return all.data() + i * numbers; }
};

// A document and its buffers.
class Document {
public:
    explicit Document(const std::filesystem::path& path) : folder_(path.parent_path())
    {
        const InputFile file(path);
        std::span<const unsigned char> bytes = file.bytes();
        const bool is_binary =
            bytes.size() >= 4 && load_scalar<std::uint32_t>(bytes.data(), ByteOrder::Little) == binary_mark;
        if (is_binary) {
            bytes = take_chunks(bytes);
            json_ = json::parse(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
        } else {
            json_ = json::parse(file.text());
        }
        check_version();
        for (const json& extension : list("extensionsRequired"))
            if (!can_read(extension.get<std::string>()))
                throw Error(fmt::format("it requires the extension \"{}\", which can't be read; export it without",
                                        extension.get<std::string>()));
    }

    // Returns a list of the document, empty if there is none.
    const json& list(const char* name) const
    {
        static const json none = json::array();
        const auto found = json_.find(name);
        return found == json_.end() ? none : *found;
    }
    const json& json_of(const char* name) const { return json_.at(name); }
    bool has(const char* name) const { return json_.contains(name); }

    const json& accessor(const json& index) const { return element(list("accessors"), "accessor", index); }

    // Returns the values of an accessor. Without a buffer view they are zeros, which a sparse accessor changes.
    Values values(const json& index)
    {
        const json& accessor = this->accessor(index);
        const auto number = index.get<std::size_t>();
        const Component& component = component_of(accessor.at("componentType").get<int>());
        Values values;
        values.count = accessor.at("count").get<std::size_t>();
        values.numbers = numbers_of(accessor.at("type").get<std::string>());
        const double scale = accessor.value("normalized", false) ? 1 / component.largest : 1;
        const auto scaled = [scale](double value) { return scale == 1 ? value : std::max(value * scale, -1.0); };
        std::optional<View> view;
        if (accessor.contains("bufferView"))
            view = view_of(number, accessor, component, values.numbers, values.count);
        else if (const double bytes = 8.0 * static_cast<double>(values.numbers) * static_cast<double>(values.count);
                 !fits_in_memory(bytes))
            throw memory_exceeded(fmt::format("an accessor of {} values", values.count), bytes, "split the file");
        values.all.assign(values.count * values.numbers, 0);
        for (std::size_t i = 0; view && i < values.count; ++i)
            for (std::size_t c = 0; c < values.numbers; ++c)
                values.all[i * values.numbers + c] = scaled(view->number(i, c, component));
        const auto sparse = accessor.find("sparse");
        if (sparse == accessor.end()) return values;
        const json& places = sparse->at("indices");
        const Component& place_component = component_of(places.at("componentType").get<int>());
        const auto changed = sparse->at("count").get<std::size_t>();
        const View at = view_of(number, places, place_component, 1, changed);
        const View changes = view_of(number, sparse->at("values"), component, values.numbers, changed);
        for (std::size_t i = 0; i < changed; ++i) {
            const double place = at.number(i, 0, place_component);
            if (!(place >= 0 && place < static_cast<double>(values.count)))
                throw Error(fmt::format("a sparse accessor of {} values changes the value {}", values.count, place));
            for (std::size_t c = 0; c < values.numbers; ++c)
                values.all[static_cast<std::size_t>(place) * values.numbers + c] =
                    scaled(changes.number(i, c, component));
        }
        return values;
    }

private:
    struct View {
        const unsigned char* begin;
        std::size_t stride;

        double number(std::size_t i, std::size_t c, const Component& component) const
        {
            const unsigned char* at = begin + i * stride + c * scalar_bytes(component.type);
            return with_scalar(component.type, [&](auto like) {
                return static_cast<double>(load_scalar<decltype(like)>(at, ByteOrder::Little));
            });
        }
    };

    static std::size_t numbers_of(const std::string& type)
    {
        static const std::map<std::string, std::size_t> numbers = {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4},
                                                                   {"MAT2", 4},   {"MAT3", 9}, {"MAT4", 16}};
        const auto found = numbers.find(type);
        if (found == numbers.end()) throw Error(fmt::format("an accessor is of the unknown type \"{}\"", type));
        return found->second;
    }

    void check_version() const
    {
        const auto asset = json_.find("asset");
        if (asset == json_.end() || !asset->contains("version")) return;
        const json& version = asset->at("version");
        const std::string text =
            version.is_number() ? fmt::format("{}", version.get<double>()) : version.get<std::string>();
        if (!text.starts_with("2"))
            throw Error(fmt::format("it is glTF {}, which can't be read; export glTF 2.0", text));
    }

    // Returns the JSON text of a binary file and keeps its binary chunk. The first chunk of a type counts, and what
    // follows the length in the header does not.
    std::span<const unsigned char> take_chunks(std::span<const unsigned char> file)
    {
        constexpr std::size_t header = 12, head = 8;
        if (const auto version =
                file.size() < header ? 0 : load_scalar<std::uint32_t>(file.data() + 4, ByteOrder::Little);
            version != 2)
            throw Error(fmt::format("it is binary glTF {}, which can't be read; export glTF 2.0", version));
        file = file.first(
            std::min<std::size_t>(file.size(), load_scalar<std::uint32_t>(file.data() + 8, ByteOrder::Little)));
        std::span<const unsigned char> text;
        for (std::size_t at = header; at + head <= file.size();) {
            const auto size = load_scalar<std::uint32_t>(file.data() + at, ByteOrder::Little);
            const auto type = load_scalar<std::uint32_t>(file.data() + at + 4, ByteOrder::Little);
            if (size > file.size() - at - head) throw Error("the file ends within a chunk");
            const auto chunk = file.subspan(at + head, size);
            if (type == json_chunk && text.empty()) text = chunk;
            if (type == binary_chunk && !binary_) binary_ = Bytes(chunk.begin(), chunk.end());
            at += head + size;
        }
        return text;
    }

    const Bytes& buffer(const json& index)
    {
        const json& buffer = element(list("buffers"), "buffer", index);
        const auto number = index.get<std::size_t>();
        const auto [found, is_new] = buffers_.try_emplace(number);
        Bytes& bytes = found->second;
        if (!is_new) return bytes;
        if (number == 0 && binary_ && !buffer.contains("uri"))
            bytes = std::move(*binary_);
        else
            bytes = bytes_of(buffer.at("uri").get<std::string>(), number);
        if (const auto length = buffer.value("byteLength", std::size_t{0}); bytes.size() < length)
            throw Error(fmt::format("buffer {} has {} bytes; its byteLength is {}", number, bytes.size(), length));
        return bytes;
    }

    Bytes bytes_of(const std::string& uri, std::size_t number) const
    {
        if (uri.starts_with("data:")) {
            const std::size_t comma = uri.find(',');
            if (comma == std::string::npos)
                throw Error(fmt::format("buffer {} has a data URI without a comma before its data", number));
            const std::string data = from_uri(std::string_view(uri).substr(comma + 1));
            if (std::string_view(uri).substr(0, comma).ends_with(";base64")) return from_base64(data);
            return {data.begin(), data.end()};
        }
        const std::string name = from_uri(uri);
        try {
            const InputFile file(folder_ / name);
            return {file.bytes().begin(), file.bytes().end()};
        } catch (const Error& error) {
            throw Error(fmt::format("its buffer \"{}\" {}", name, error.message()));
        }
    }

    // Returns the values of an accessor, or of a part of a sparse one.
    View view_of(std::size_t accessor, const json& place, const Component& component, std::size_t numbers,
                 std::size_t count)
    {
        const json& index = place.at("bufferView");
        const json& view = element(list("bufferViews"), "buffer view", index);
        const Bytes& bytes = buffer(view.at("buffer"));
        const std::size_t value = numbers * scalar_bytes(component.type);
        const std::size_t stride = view.value("byteStride", value);
        const std::size_t first = view.value("byteOffset", std::size_t{0}),
                          inner = place.value("byteOffset", std::size_t{0});
        const std::size_t length = view.value("byteLength", bytes.size() - std::min(first, bytes.size()));
        if (first > bytes.size() || length > bytes.size() - first)
            throw Error(fmt::format("buffer view {} goes beyond its buffer", index.get<std::size_t>()));
        if (inner > length || stride > bytes.size() ||
            (count > 0 &&
             (length - inner < value || (count - 1) > (length - inner - value) / std::max<std::size_t>(stride, 1))))
            throw Error(fmt::format("accessor {} of {} values goes beyond its buffer view {}", accessor, count,
                                    index.get<std::size_t>()));
        return {bytes.data() + first + inner, stride};
    }

    const std::filesystem::path folder_;
    json json_;
    std::optional<Bytes> binary_;  // the binary chunk
    std::map<std::size_t, Bytes> buffers_;
};

std::vector<Vec3f> vectors(const Values& values)
{
    std::vector<Vec3f> list;
    list.reserve(values.count);
    for (std::size_t i = 0; i < values.count; ++i) {
        Vec3f& vector = list.emplace_back(Vec3f::Zero());
        for (std::size_t c = 0; c < std::min<std::size_t>(values.numbers, 3); ++c)
            vector[c] = static_cast<float>(values[i][c]);
    }
    return list;
}

std::vector<float> floats(const Values& values) { return {values.all.begin(), values.all.end()}; }

template <class Vector>
Vector vector_of(const json& list)
{
    Vector vector;
    for (int k = 0; k < vector.size(); ++k) vector[k] = list.at(static_cast<std::size_t>(k)).get<double>();
    return vector;
}

Eigen::Affine3d affine(const double* columns)
{
    Eigen::Affine3d map;
    map.matrix() = Eigen::Map<const Eigen::Matrix4d>(columns);
    map.makeAffine();
    return map;
}

std::string name_in(const json& object) { return object.value("name", std::string()); }

class GltfReader {
public:
    explicit GltfReader(const std::filesystem::path& path) : document_(path) {}

    GltfFile read()
    {
        for (const json& mesh : document_.list("meshes")) read_mesh(mesh);
        for (const json& node : document_.list("nodes")) read_node(node);
        for (const json& skin : document_.list("skins")) read_skin(skin);
        for (const json& animation : document_.list("animations")) read_animation(animation);
        for (GltfNode& node : file_.nodes)
            if (node.skin) check(*node.skin, file_.skins.size(), "a node has the skin");
        set_parents();
        choose_nodes();
        if (!document_.list("cameras").empty()) add_skipped(file_.skipped, "its cameras");
        return std::move(file_);
    }

private:
    static std::size_t check(std::size_t index, std::size_t count, const char* what)
    {
        if (index >= count) throw Error(fmt::format("{} {}; there are {}, from 0", what, index, count));
        return index;
    }
    static std::optional<std::size_t> optional_index(const json& object, const char* name)
    {
        const auto found = object.find(name);
        if (found == object.end()) return std::nullopt;
        return found->get<std::size_t>();
    }

    void read_mesh(const json& json_mesh)
    {
        GltfMesh& mesh = file_.meshes.emplace_back();
        mesh.name = name_in(json_mesh);
        if (const auto weights = json_mesh.find("weights"); weights != json_mesh.end())
            for (const json& weight : *weights) mesh.weights.push_back(static_cast<float>(weight.get<double>()));
        for (const json& primitive : json_mesh.at("primitives")) read_primitive(primitive, mesh);
    }

    void read_primitive(const json& json_primitive, GltfMesh& mesh)
    {
        constexpr int triangles = 4, strip = 5, fan = 6;
        const int mode = json_primitive.value("mode", triangles);
        if (mode != triangles && mode != strip && mode != fan) {
            if (mode < 0 || mode > fan) throw Error(fmt::format("a primitive has the unknown mode {}", mode));
            return add_skipped(file_.skipped, mode == 0 ? "its points" : "its lines");
        }
        const json& attributes = json_primitive.at("attributes");
        if (!attributes.contains("POSITION")) return add_skipped(file_.skipped, "its primitive without positions");
        GltfPrimitive& primitive = mesh.primitives.emplace_back();
        primitive.positions = vectors(document_.values(attributes.at("POSITION")));
        vertices_ = primitive.positions.size();
        if (vertices_ > std::size_t{1} << 31) throw Error("a primitive has more than 2^31 vertices");
        for (const auto& [name, number] : attributes.items()) read_attribute(name, number, primitive);
        read_triangles(json_primitive, mode, primitive);
        if (const auto targets = json_primitive.find("targets"); targets != json_primitive.end())
            for (const json& target : *targets) read_target(target, primitive);
        if (const auto material = optional_index(json_primitive, "material")) {
            const json& materials = document_.list("materials");
            primitive.material = name_in(materials.at(check(*material, materials.size(), "a mesh has the material")));
        }
    }

    Values values_at_vertices(const std::string& name, const json& number)
    {
        Values values = document_.values(number);
        if (values.count != vertices_)
            throw Error(fmt::format("{} has {} values; there are {} vertices", name, values.count, vertices_));
        return values;
    }

    void read_attribute(const std::string& name, const json& number, GltfPrimitive& primitive)
    {
        constexpr std::string_view coordinates = "TEXCOORD_";
        if (name == "NORMAL") {
            primitive.normals = vectors(values_at_vertices(name, number));
        } else if (name == "COLOR_0") {
            const Values values = values_at_vertices(name, number);
            primitive.colours = vectors(values);
            primitive.alphas.assign(vertices_, 1.0f);
            if (values.numbers == 4)
                for (std::size_t i = 0; i < vertices_; ++i) primitive.alphas[i] = static_cast<float>(values[i][3]);
        } else if (name.starts_with(coordinates)) {
            std::vector<Vec3f> uv = vectors(values_at_vertices(name, number));
            for (Vec3f& place : uv) place.y() = 1 - place.y();  // glTF counts v downwards
            const std::string set = name.substr(coordinates.size());
            primitive.values["uv" + (set == "0" ? "" : set_name(set))] = std::move(uv);
        } else if (name.starts_with("JOINTS_")) {
            read_influences(values_at_vertices(name, number), primitive.joints);
        } else if (name.starts_with("WEIGHTS_")) {
            read_influences(values_at_vertices(name, number), primitive.weights);
        } else if (name.starts_with('_')) {
            read_custom(name, number, primitive);
        }
    }

    // Returns the number of a set from 1 instead of 0.
    static std::string set_name(const std::string& set)
    {
        int number = 0;
        std::from_chars(set.data(), set.data() + set.size(), number);
        return fmt::format("{}", number + 1);
    }

    template <class Four>
    static void read_influences(const Values& values, std::vector<Four>& list)
    {
        if (values.numbers != 4) throw Error("joints and weights must be vectors of four");
        for (std::size_t i = 0; i < values.count; ++i) {
            Four& four = list.emplace_back();
            for (std::size_t c = 0; c < 4; ++c)
                four[c] = static_cast<typename Four::value_type>(std::max(0.0, values[i][c]));
        }
    }

    // Reads _NAME as NAME, if it is a number or a vector of three and no attribute has that name.
    void read_custom(const std::string& name, const json& number, GltfPrimitive& primitive)
    {
        static const std::set<std::string> taken = {"P", "v", "id", "N", "Cd", "Alpha", "uv", ""};
        const std::string stem = name.substr(1);
        const auto type = document_.accessor(number).at("type").get<std::string>();
        if (taken.count(stem) > 0 || (type != "SCALAR" && type != "VEC3"))
            return add_skipped(file_.skipped, fmt::format("the attribute \"{}\"", name));
        const Values values = values_at_vertices(name, number);
        if (values.numbers == 3)
            primitive.values[stem] = vectors(values);
        else
            primitive.values[stem] = floats(values);
    }

    void read_triangles(const json& json_primitive, int mode, GltfPrimitive& primitive)
    {
        std::vector<std::int32_t> corners;
        if (const auto indices = json_primitive.find("indices"); indices != json_primitive.end()) {
            for (const double index : document_.values(*indices).all) {
                if (!(index >= 0 && index < static_cast<double>(vertices_)))
                    throw Error(
                        fmt::format("a face has the vertex {}; the mesh has {}, numbered from 0", index, vertices_));
                corners.push_back(static_cast<std::int32_t>(index));
            }
        } else {
            for (std::size_t i = 0; i < vertices_; ++i) corners.push_back(static_cast<std::int32_t>(i));
        }
        constexpr int triangles = 4, strip = 5;
        const std::size_t step = mode == triangles ? 3 : 1;
        if (mode == triangles && corners.size() % 3 != 0)
            throw Error(
                fmt::format("a mesh has {} indices of triangles; they must be a multiple of 3", corners.size()));
        for (std::size_t k = 0; k + 2 < corners.size(); k += step) {
            if (mode == triangles || (mode == strip && k % 2 == 0))
                primitive.triangles.emplace_back(corners[k], corners[k + 1], corners[k + 2]);
            else if (mode == strip)
                primitive.triangles.emplace_back(corners[k + 1], corners[k], corners[k + 2]);
            else
                primitive.triangles.emplace_back(corners[0], corners[k + 1], corners[k + 2]);
        }
    }

    void read_target(const json& json_target, GltfPrimitive& primitive)
    {
        GltfPrimitive::Target& target = primitive.targets.emplace_back();
        if (json_target.contains("POSITION"))
            target.positions = vectors(values_at_vertices("POSITION", json_target.at("POSITION")));
        if (json_target.contains("NORMAL"))
            target.normals = vectors(values_at_vertices("NORMAL", json_target.at("NORMAL")));
    }

    void read_node(const json& json_node)
    {
        GltfNode& node = file_.nodes.emplace_back();
        node.name = name_in(json_node);
        node.mesh = optional_index(json_node, "mesh");
        if (node.mesh) check(*node.mesh, file_.meshes.size(), "a node has the mesh");
        node.skin = optional_index(json_node, "skin");
        GltfTransform& transform = node.transform;
        if (json_node.contains("matrix"))
            transform.matrix = affine(vector_of<Eigen::Matrix<double, 16, 1>>(json_node.at("matrix")).data());
        if (json_node.contains("translation")) transform.translation = vector_of<Vec3d>(json_node.at("translation"));
        if (json_node.contains("scale")) transform.scale = vector_of<Vec3d>(json_node.at("scale"));
        if (json_node.contains("rotation"))
            transform.rotation = Eigen::Quaterniond(vector_of<Eigen::Vector4d>(json_node.at("rotation")));
        if (const auto weights = json_node.find("weights"); weights != json_node.end())
            for (const json& weight : *weights) node.weights.push_back(static_cast<float>(weight.get<double>()));
        read_instances(json_node, node);
    }

    void read_instances(const json& json_node, GltfNode& node)
    {
        const auto extensions = json_node.find("extensions");
        if (extensions == json_node.end() || !extensions->contains("EXT_mesh_gpu_instancing")) return;
        const json& attributes = extensions->at("EXT_mesh_gpu_instancing").at("attributes");
        std::map<std::string, Values> values;
        for (const char* name : {"TRANSLATION", "ROTATION", "SCALE"})
            if (attributes.contains(name)) values[name] = document_.values(attributes.at(name));
        if (values.empty()) return;
        const std::size_t count = values.begin()->second.count;
        for (const auto& [name, list] : values)
            if (list.count != count || list.numbers != (name == "ROTATION" ? 4u : 3u))
                throw Error(fmt::format("the instances of a node have {} values of {}; there must be {}", list.count,
                                        name, count));
        for (std::size_t i = 0; i < count; ++i) {
            GltfTransform transform;
            if (values.count("TRANSLATION")) transform.translation = Eigen::Map<const Vec3d>(values["TRANSLATION"][i]);
            if (values.count("SCALE")) transform.scale = Eigen::Map<const Vec3d>(values["SCALE"][i]);
            if (values.count("ROTATION")) transform.rotation = Eigen::Quaterniond(values["ROTATION"][i]);
            node.instances.push_back(transform.map());
        }
    }

    void read_skin(const json& json_skin)
    {
        GltfSkin& skin = file_.skins.emplace_back();
        for (const json& joint : json_skin.at("joints"))
            skin.joints.push_back(check(joint.get<std::size_t>(), file_.nodes.size(), "a skin has the joint"));
        skin.inverse_binds.assign(skin.joints.size(), Eigen::Affine3d::Identity());
        if (!json_skin.contains("inverseBindMatrices")) return;
        const Values binds = document_.values(json_skin.at("inverseBindMatrices"));
        if (binds.numbers != 16 || binds.count < skin.joints.size())
            throw Error(
                fmt::format("a skin of {} joints has {} inverse bind matrices", skin.joints.size(), binds.count));
        for (std::size_t k = 0; k < skin.joints.size(); ++k) skin.inverse_binds[k] = affine(binds[k]);
    }

    void read_animation(const json& json_animation)
    {
        static const std::map<std::string, GltfChannel::Path> paths = {{"translation", GltfChannel::Translation},
                                                                       {"rotation", GltfChannel::Rotation},
                                                                       {"scale", GltfChannel::Scale},
                                                                       {"weights", GltfChannel::Weights}};
        static const std::map<std::string, GltfChannel::Interpolation> interpolations = {
            {"STEP", GltfChannel::Step}, {"LINEAR", GltfChannel::Linear}, {"CUBICSPLINE", GltfChannel::Cubic}};
        GltfAnimation& animation = file_.animations.emplace_back();
        animation.name = name_in(json_animation);
        for (const json& json_channel : json_animation.at("channels")) {
            const json& target = json_channel.at("target");
            const auto path = paths.find(target.at("path").get<std::string>());
            if (path == paths.end() || !target.contains("node")) continue;  // the animation of an extension
            const json& sampler = element(json_animation.at("samplers"), "sampler", json_channel.at("sampler"));
            GltfChannel& channel = animation.channels.emplace_back();
            channel.node = check(target.at("node").get<std::size_t>(), file_.nodes.size(), "an animation has the node");
            channel.path = path->second;
            const auto interpolation = interpolations.find(sampler.value("interpolation", std::string("LINEAR")));
            if (interpolation == interpolations.end()) throw Error("an animation has an unknown interpolation");
            channel.interpolation = interpolation->second;
            channel.times = floats(document_.values(sampler.at("input")));
            channel.values = floats(document_.values(sampler.at("output")));
            set_numbers(channel);
        }
    }

    void set_numbers(GltfChannel& channel) const
    {
        const GltfNode& node = file_.nodes[channel.node];
        channel.numbers = channel.path == GltfChannel::Rotation ? 4 : 3;
        if (channel.path == GltfChannel::Weights) {
            channel.numbers = 0;
            if (node.mesh)
                for (const GltfPrimitive& primitive : file_.meshes[*node.mesh].primitives)
                    channel.numbers = std::max(channel.numbers, primitive.targets.size());
        }
        const std::size_t keys = channel.interpolation == GltfChannel::Cubic ? 3 : 1;
        if (channel.times.empty() || channel.values.size() != channel.times.size() * keys * channel.numbers)
            throw Error(fmt::format("an animation of {} keys has {} numbers; there must be {}", channel.times.size(),
                                    channel.values.size(), channel.times.size() * keys * channel.numbers));
        if (!std::is_sorted(channel.times.begin(), channel.times.end()) ||
            !std::all_of(channel.times.begin(), channel.times.end(), [](float time) { return std::isfinite(time); }))
            throw Error("the times of an animation decrease");
    }

    void set_parents()
    {
        const json& nodes = document_.list("nodes");
        for (std::size_t k = 0; k < nodes.size(); ++k) {
            const auto children = nodes.at(k).find("children");
            if (children == nodes.at(k).end()) continue;
            for (const json& json_child : *children) {
                const std::size_t child = check(json_child.get<std::size_t>(), nodes.size(), "a node has the child");
                if (file_.nodes[child].parent)
                    throw Error(fmt::format("node {} has two parents; the nodes must be a tree", child));
                file_.nodes[child].parent = k;
            }
        }
        std::vector<std::size_t> roots;
        for (std::size_t k = 0; k < nodes.size(); ++k)
            if (!file_.nodes[k].parent) roots.push_back(k);
        file_.order = with_children(roots);
        if (file_.order.size() < nodes.size()) throw Error("a node is below itself; the nodes must be a tree");
    }

    // Returns these nodes and all below them, each after its parent, in the order of the file.
    std::vector<std::size_t> with_children(const std::vector<std::size_t>& roots) const
    {
        const json& nodes = document_.list("nodes");
        std::vector<std::size_t> stack(roots.rbegin(), roots.rend()), order;
        std::vector<bool> is_in(nodes.size(), false);
        while (!stack.empty()) {
            const std::size_t k = stack.back();
            stack.pop_back();
            if (is_in[k]) throw Error(fmt::format("node {} is in a scene twice", k));
            is_in[k] = true;
            order.push_back(k);
            const auto children = nodes.at(k).find("children");
            if (children == nodes.at(k).end()) continue;
            for (std::size_t c = children->size(); c > 0; --c) stack.push_back(children->at(c - 1).get<std::size_t>());
        }
        return order;
    }

    // Sets the nodes of the file's default scene, of its first one, or all if there are no scenes.
    void choose_nodes()
    {
        const json& scenes = document_.list("scenes");
        file_.shown = file_.order;
        if (scenes.empty()) return;
        const std::size_t number =
            document_.has("scene") ? document_.json_of("scene").get<std::size_t>() : std::size_t{0};
        const json& scene = scenes.at(check(number, scenes.size(), "the file shows the scene"));
        std::vector<std::size_t> roots;
        if (const auto nodes = scene.find("nodes"); nodes != scene.end())
            for (const json& node : *nodes)
                roots.push_back(check(node.get<std::size_t>(), file_.nodes.size(), "a scene has the node"));
        file_.shown = with_children(roots);
    }

    Document document_;
    GltfFile file_;
    std::size_t vertices_ = 0;  // of the current primitive
};

}  // namespace

Eigen::Affine3d GltfTransform::map() const
{
    if (matrix) return *matrix;
    return Eigen::Translation3d(translation) * rotation.normalized() * Eigen::Scaling(scale);
}

GltfFile read_gltf(const std::filesystem::path& path)
{
    try {
        return GltfReader(path).read();
    } catch (const json::out_of_range& error) {
        const std::string_view text = error.what();  // "[json.exception.out_of_range.403] key 'count' not found"
        throw Error(fmt::format("it is incomplete: {}", text.substr(text.find("] ") + 2)));
    } catch (const json::exception& error) {
        throw Error(fmt::format("its JSON is damaged: {}", error.what()));
    }
}

}  // namespace rapid
