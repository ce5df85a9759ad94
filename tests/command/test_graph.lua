-- rapid graph: the picture of a graph.
local scene = require "testing.scene"
local command = require "testing.command"

local text = [[
local chain = rapid.create { fps = 24, points = two } :gravity { name = "down <b>&\"\\N" } :solve { name = "end" }
rapid.create { name = "spare" } :drag { linear = 1 }
return chain]]

local function draw(file)
  local result = scene.command("graph", text, "-o " .. file)
  assert.equal(0, result.status, result.stderr)
  return scene.folder:read(file)
end

describe("graph", function()
  it("has a node for each node and an edge for each flow, back from Solve to Create too", function()
    local dot = draw "g.dot"
    local nodes, edges = 0, {}
    for _ in dot:gmatch "\n  n%d+ %[label" do nodes = nodes + 1 end
    for from, to in dot:gmatch "\n  (n%d+) %-> (n%d+)" do edges[from .. to] = (edges[from .. to] or 0) + 1 end
    assert.equal(5, nodes)
    assert.same({ n0n1 = 1, n1n2 = 1, n2n0 = 1, n3n4 = 1 }, edges)
    assert.truthy(dot:find("next frame", 1, true))
  end)

  it("shows names as they are, whatever they hold", function()
    local svg = draw "g.svg"
    assert.truthy(svg:find("down &lt;b&gt;&amp;&quot;\\N", 1, true), svg)
    assert.falsy(svg:find("<b>", 1, true))
  end)

  it("is laid out from left to right, and tells why nodes are left out", function()
    local json = draw "g.json"
    local x = {}
    for name, place in json:gmatch '"name":"([^"]-)","type".-"x":([%d.]+)' do x[name] = tonumber(place) end
    assert.is_true(x.create1 < x["end"])
    assert.truthy(json:find('"kept":false,"evaluated":"never","why":"leads to no output"', 1, true), json)
  end)

  it("names the missing program if there is no dot", function()
    scene.write(text)
    local options = { cwd = scene.folder.path, environment = { PATH = "/none" } }
    local result = command.rapid("graph scene.lua -o g.svg", options)
    assert.equal(2, result.status)
    assert.truthy(result.stderr:find("apt install graphviz", 1, true), result.stderr)
  end)

  it("refuses another kind of file", function()
    local result = scene.command("graph", text, "-o g.png")
    assert.equal(2, result.status)
    assert.truthy(result.stderr:find(".svg, .dot or .json", 1, true))
  end)
end)
