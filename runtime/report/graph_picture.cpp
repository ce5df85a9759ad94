#include "runtime/report/graph_picture.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "runtime/base/error.h"
#include "runtime/base/json.h"
#include "runtime/base/printable.h"
#include "runtime/files/file_error.h"
#include "runtime/files/start_program.h"
#include "runtime/graph/explain.h"
#include "runtime/graph/node_type.h"

namespace rapid {
namespace {

using Edge = GraphPicture::Edge;

const char* name_of(NodeKind kind)
{
    switch (kind) {
        case NodeKind::Source:
            return "source";
        case NodeKind::Points:
            return "points";
        case NodeKind::Dynamic:
            return "dynamic";
        case NodeKind::Merge:
            return "merge";
        case NodeKind::Solve:
            return "solve";
    }
    return "";
}

const char* name_of(Edge::Kind kind)
{
    return kind == Edge::Kind::Flow ? "flow" : kind == Edge::Kind::Source ? "source" : "feedback";
}

// Returns any text as UTF-8 without control characters.
std::string clean(const std::string& text) { return CheckedJson::parse(json_text(printable(text))).get<std::string>(); }

// Returns a string in Graphviz's language, in which \N and the like stand for names.
std::string quoted(const std::string& text)
{
    std::string result = "\"";
    for (const char c : clean(text)) {
        if (c == '"' || c == '\\') result += '\\';
        if (c == '\n')
            result += "\\n";
        else
            result += c;
    }
    return result + '"';
}

GraphPicture::Node node_of(const Node& node)
{
    GraphPicture::Node made;
    made.name = node.name;
    made.type = node.type->name;
    made.kind = name_of(node.type->kind);
    made.file = node.location.file;
    made.line = node.location.line;
    for (const auto& [name, value] : node.arguments) made.arguments.emplace_back(name, describe(value));
    return made;
}

void draw_attributes(const Plan& plan, GraphPicture& picture)
{
    for (const PlannedSimulation& simulation : plan.simulations)
        for (const PlannedAttribute& attribute : simulation.attributes) {
            for (const std::size_t i : attribute.made_by) picture.nodes[i].makes.push_back(attribute.name);
            for (const std::size_t i : attribute.read_by) picture.nodes[i].reads.push_back(attribute.name);
            for (const std::size_t i : attribute.written_by) picture.nodes[i].writes.push_back(attribute.name);
        }
}

void add_edges(const Plan& plan, const std::map<const Node*, std::size_t>& indices, GraphPicture& picture)
{
    const auto add = [&](const Node* from, std::size_t to, Edge::Kind kind) {
        if (const auto found = indices.find(from); found != indices.end())
            picture.edges.push_back({found->second, to, kind});
    };
    const auto add_inputs = [&](const NodePtr& node, std::size_t i) {
        for (const NodePtr& input : node->inputs) add(input.get(), i, Edge::Kind::Flow);
        for (const auto& [name, value] : node->arguments)
            if (const auto handle = value.object<NodeHandle>()) add(handle->node.get(), i, Edge::Kind::Source);
    };
    for (std::size_t i = 0; i < plan.nodes.size(); ++i) add_inputs(plan.nodes[i].node, i);
    for (std::size_t i = 0; i < plan.pruned.size(); ++i) add_inputs(plan.pruned[i], plan.nodes.size() + i);
    for (const PlannedSimulation& simulation : plan.simulations)
        if (simulation.solve) add(simulation.solve.get(), indices.at(simulation.create.get()), Edge::Kind::Feedback);
}

const char* colour_of(const GraphPicture::Node& node)
{
    if (!node.kept) return "#ffffff";
    if (node.kind == "source" || node.kind == "solve") return "#cfe0f5";
    if (node.kind == "dynamic") return "#f6e3c5";
    return node.kind == "merge" ? "#e4daf0" : "#dcebd3";
}

std::string tip_of(const GraphPicture::Node& node)
{
    std::string tip = fmt::format("{}:{}", node.file, node.line);
    for (const auto& [name, value] : node.arguments) tip += fmt::format("\n{} = {}", name, value);
    tip += fmt::format("\n{}: {}", node.kept ? "evaluated " + node.evaluated : "pruned", node.why);
    return node.changes.empty() ? tip : fmt::format("{}; {}", tip, node.changes);
}

// Returns the numbers of a text such as "e,27,18 54.5,18" in pairs; the arrow's head, marked by a letter, comes last.
CheckedJson path_of(const std::string& text, double height)
{
    CheckedJson path = CheckedJson::array(), head;
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find(' ', begin), text.size());
        const std::string word = text.substr(begin, end - begin);
        const bool marked = !word.empty() && (word[0] == 'e' || word[0] == 's');
        double x = 0, y = 0;
        if (std::sscanf(word.c_str() + (marked ? 2 : 0), "%lf,%lf", &x, &y) == 2)
            (marked ? head : path).push_back(marked ? CheckedJson(x) : CheckedJson({x, height - y}));
        if (marked) head.push_back(height - y);
        begin = end + 1;
    }
    if (!head.is_null()) path.push_back(head);
    return path;
}

// Sets positions by the names that to_dot() assigns, n0, n1, ...; edges have the order in which it writes them.
void place(const CheckedJson& laid_out, CheckedJson& nodes, CheckedJson& edges, CheckedJson& size)
{
    double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
    const std::string box = laid_out.value("bb", "");
    if (std::sscanf(box.c_str(), "%lf,%lf,%lf,%lf", &x0, &y0, &x1, &y1) != 4) return;
    size = {x1, y1};
    for (const CheckedJson& object : laid_out.value("objects", CheckedJson::array())) {
        const std::string name = object.value("name", "");
        std::size_t i = 0;
        double x = 0, y = 0;
        if (std::sscanf(name.c_str(), "n%zu", &i) != 1 || i >= nodes.size() ||
            std::sscanf(object.value("pos", "").c_str(), "%lf,%lf", &x, &y) != 2)
            continue;
        nodes[i]["x"] = x;
        nodes[i]["y"] = y1 - y;
        nodes[i]["width"] = 72 * std::stod(object.value("width", "0"));
        nodes[i]["height"] = 72 * std::stod(object.value("height", "0"));
    }
    for (const CheckedJson& edge : laid_out.value("edges", CheckedJson::array())) {
        std::size_t i = 0;
        if (std::sscanf(edge.value("id", "").c_str(), "e%zu", &i) == 1 && i < edges.size())
            edges[i]["path"] = path_of(edge.value("pos", ""), y1);
    }
}

}  // namespace

GraphPicture picture_of(const Plan& plan)
{
    GraphPicture picture;
    std::map<const Node*, std::size_t> indices;
    const Explanation explained = explain(plan, {});
    for (const PlannedNode& planned : plan.nodes) {
        indices[planned.node.get()] = picture.nodes.size();
        picture.nodes.push_back(node_of(*planned.node));
        picture.nodes.back().simulation = plan.simulations[planned.simulation].create->name;
    }
    for (const NodePtr& node : plan.pruned) {
        indices[node.get()] = picture.nodes.size();
        picture.nodes.push_back(node_of(*node));
    }
    // The explanation has the nodes in the same order.
    for (std::size_t i = 0; i < picture.nodes.size(); ++i) {
        const Explanation::ExplainedNode& node = explained.nodes[i];
        picture.nodes[i].kept = node.kept;
        picture.nodes[i].evaluated = node.evaluated;
        picture.nodes[i].why = node.why;
        picture.nodes[i].changes = node.changes;
    }
    draw_attributes(plan, picture);
    add_edges(plan, indices, picture);
    picture.outputs = plan.outputs;
    return picture;
}

std::string to_dot(const GraphPicture& picture, Tips tips)
{
    std::string text =
        "digraph scene {\n"
        "  rankdir = LR; nodesep = 0.18; ranksep = 0.32; bgcolor = transparent;\n"
        "  node [shape = box, style = \"filled,rounded\", color = \"#8a8f98\", fontname = \"sans-serif\", fontsize = "
        "11, "
        "width = 1.3, height = 0.5, margin = \"0.12,0.05\"];\n"
        "  edge [color = \"#6b7078\", fontname = \"sans-serif\", fontsize = 9, arrowsize = 0.7];\n";
    for (std::size_t i = 0; i < picture.nodes.size(); ++i) {
        const GraphPicture::Node& node = picture.nodes[i];
        text +=
            fmt::format("  n{} [label = {}, tooltip = {}, fillcolor = \"{}\"{}];\n", i,
                        quoted(node.name + '\n' + node.type), quoted(tips == Tips::Kept ? tip_of(node) : std::string()),
                        colour_of(node), node.kept ? "" : ", style = \"dashed,rounded\", fontcolor = \"#8a8f98\"");
    }
    for (std::size_t i = 0; i < picture.edges.size(); ++i) {
        const Edge& edge = picture.edges[i];
        // A Solve stands right of its Create: the edge back must not turn that round.
        const char* const look = edge.kind == Edge::Kind::Flow     ? ""
                                 : edge.kind == Edge::Kind::Source ? ", style = dotted, label = source"
                                                                   : ", style = dashed, constraint = false, "
                                                                     "label = \"next frame\"";
        text += fmt::format("  n{} -> n{} [id = e{}{}];\n", edge.from, edge.to, i, look);
    }
    std::size_t number = 0;
    for (const auto& [name, i] : picture.outputs)
        text += fmt::format(
            "  out{0} [label = {1}, tooltip = \"output\", shape = plaintext, style = \"\"];\n  n{2} -> out{0};\n",
            number++, quoted(name), i);
    return text + "}\n";
}

std::string to_json(const GraphPicture& picture, const std::string& laid_out)
{
    CheckedJson nodes = CheckedJson::array(), edges = CheckedJson::array(), outputs = CheckedJson::object(), size;
    for (const GraphPicture::Node& node : picture.nodes) {
        CheckedJson arguments = CheckedJson::object();
        for (const auto& [name, value] : node.arguments) arguments[clean(name)] = clean(value);
        nodes.push_back({{"name", clean(node.name)},
                         {"type", node.type},
                         {"kind", node.kind},
                         {"file", clean(node.file)},
                         {"line", node.line},
                         {"simulation", clean(node.simulation)},
                         {"kept", node.kept},
                         {"evaluated", node.evaluated},
                         {"why", node.why},
                         {"changes", node.changes},
                         {"arguments", arguments},
                         {"makes", node.makes},
                         {"reads", node.reads},
                         {"writes", node.writes}});
    }
    for (const Edge& edge : picture.edges)
        edges.push_back({{"from", edge.from}, {"to", edge.to}, {"kind", name_of(edge.kind)}});
    for (const auto& [name, i] : picture.outputs) outputs[clean(name)] = i;
    if (!laid_out.empty()) place(CheckedJson::parse(laid_out), nodes, edges, size);
    CheckedJson json = {{"nodes", nodes}, {"edges", edges}, {"outputs", outputs}};
    if (!size.is_null()) json["size"] = size;
    return json_text(json);
}

namespace {

// Returns a file in memory: unlike a pipe it never blocks dot.
Descriptor memory_file()
{
    Descriptor file(memfd_create("dot", MFD_CLOEXEC));
    if (!file) throw Error(fmt::format("not enough memory for dot: {}", std::strerror(errno)));
    return file;
}

void write_all(const Descriptor& file, const std::string& text)
{
    for (std::size_t written = 0; written < text.size();) {
        const ssize_t count =
            pwrite(file.number(), text.data() + written, text.size() - written, static_cast<off_t>(written));
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) throw Error(fmt::format("not enough memory for dot: {}", std::strerror(errno)));
        written += static_cast<std::size_t>(count);
    }
}

std::string read_all(const Descriptor& file)
{
    std::string text;
    char part[65536];
    while (true) {
        const ssize_t count = pread(file.number(), part, sizeof part, static_cast<off_t>(text.size()));
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) return text;
        text.append(part, static_cast<std::size_t>(count));
    }
}

}  // namespace

std::string lay_out(const std::string& graph, const std::string& format)
{
    const Descriptor input = memory_file(), output = memory_file(), messages = memory_file();
    write_all(input, graph);

    const std::string program = program_path("dot");
    if (program.empty()) throw Error("the layout needs dot; install it (apt install graphviz), or write .dot");

    const pid_t dot = start_program(
        program, {"dot", "-T" + format},
        {{input.number(), STDIN_FILENO}, {output.number(), STDOUT_FILENO}, {messages.number(), STDERR_FILENO}});
    const int status = wait_for_program(dot);
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) throw Error(fmt::format("dot failed: {}", read_all(messages)));
    return read_all(output);
}

}  // namespace rapid
