-- String attributes: created, drawn at birth, read and written by kernels and by :detail, tested by predicates, and
-- carried along by every operation.
local command = require "testing.command"
local json = require "dkjson"
local scene = require "testing.scene"

local named = 'name = {"leaf", "bark"}'

local function names_of(points)
  local names = {}
  for i = 1, #points do names[i] = points[i].name end
  return names
end

describe("an attribute that is a string", function()
  it("is made with a default, by its own name or among `attributes`", function()
    local result = scene.run [[
return rapid.create { points = two } :attribute { material = "bark", attributes = { name = "leaf" } } :solve {}]]
    assert.equal("bark", result[2][1].material)
    assert.equal("leaf", result[2][2].name)
  end)

  it("is given to points by lists", function()
    assert.same({ "leaf", "bark" }, names_of(scene.kernel("p.v = p.v", named)))
  end)

  it("is the empty string by default", function()
    local result = scene.run [[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}}, name = {"leaf"} } } :merge(rapid.create { points =
  two }) :solve {}]]
    assert.same({ "leaf", "", "" }, names_of(result[3]))
  end)

  it("is read, compared and written by kernels", function()
    local points = scene.kernel([[
if p.name == "leaf" then p.name = "a " .. p.name .. " of " .. p.index elseif p.name ~= "bark" then p.name = "?" end]],
      named)
    assert.same({ "a leaf of 1", "bark" }, names_of(points))
  end)

  it("is written alike by many threads, thousands of different ones", function()
    local text = [[
return rapid.create {} :emit { source = rapid.mesh.sphere {}, count = 30000, attributes = { name = "" } }
  :points("name", function(p) p.name = ("n%d"):format(p.id % 3000) end) :solve {}]]
    for _, threads in ipairs { 1, 4 } do
      local points = scene.run(text, { frames = {1, 3}, threads = threads })[3]
      assert.equal(60000, #points)
      for i = 1, #points, 997 do assert.equal(("n%d"):format(points[i].id % 3000), points[i].name) end
    end
  end)

  it("makes the same file on any number of threads, whichever string came first", function()
    local text = [[
local first = rapid.param("first", 0, "of texts that no point has at the end")
return rapid.create {}
  :emit { source = rapid.mesh.sphere {}, count = 20000, attributes = { name = "", kind = {"b", "a"} } }
  :points("other", function(p) if first > 0 then p.name = "x" .. (9 * p.id % 5000) end end)
  :points("name", function(p) p.name = "n" .. (p.id % 500) end) :solve {}]]
    for _, extension in ipairs { "bgeo", "vdb", "usda", "vtp", "npz", "csv" } do
      local sums = {}
      for _, arguments in ipairs { "--threads 1", "--threads 3", "--set first=1 --threads 2" } do
        local result = scene.command("run", text, ("-f 2 -o a.%s %s"):format(extension, arguments))
        assert.equal(0, result.status, result.stderr)
        sums[#sums + 1] = command.shell("sha256sum a." .. extension, { cwd = scene.folder.path }).stdout
      end
      assert.same({ sums[1], sums[1], sums[1] }, sums, extension)
    end
  end)

  it("is drawn at birth: one for all, or each of several as likely", function()
    local result = scene.run([[
return rapid.create {} :emit { source = rapid.mesh.sphere {}, count = 9000,
    attributes = { material = "bark", name = { "a", "b", "c" } } } :solve {}]], { frames = {2, 2} })
    local count = {}
    for i = 1, #result[2] do
      count[result[2][i].name] = (count[result[2][i].name] or 0) + 1
      assert.equal("bark", result[2][i].material)
    end
    -- A third of 9,000 draws each, within five standard deviations, sqrt(9000 * 1/3 * 2/3) = 44.7.
    for _, name in ipairs { "a", "b", "c" } do assert.near(3000, count[name], 224) end
  end)

  it("goes from parents to their children, and into groups by a predicate", function()
    local result = scene.run([[
local parents = rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {9, 0, 0}}, name = {"leaf", "bark"} } }
  :solve { name = "parents" }
return rapid.create {} :spawn { from = parents, count = 2, inherit = {"name"} }
  :group { name = "leaves", where = function(p) return p.name == "leaf" end } :solve {}]], { frames = {3, 3} })
    local leaves = result[3]:group "leaves"
    assert.is_true(#leaves > 0 and #leaves < #result[3])
    for i = 1, #leaves do assert.is_true(leaves[i].P.x < 5) end
  end)

  it("is read and written by :detail, and by points:add", function()
    local result = scene.run([[
return rapid.create { points = rapid.points.from { P = {{0, 1, 0}, {1, 1, 0}}, name = {"leaf", "bark"} } }
  :detail("swap", function(points, frame)
      points[1].name, points[2].name = points[2].name, points[1].name
      if frame.number == 2 then points:add { P = vec3(0, 0, 0), name = "twig" } end
    end) :solve {}]])
    assert.same({ "bark", "leaf", "twig" }, names_of(result[2]))
    assert.same({ "leaf", "bark", "twig" }, names_of(result[3]))
  end)

  it("of another type is an error with the line", function()
    assert.truthy(scene.kernel_error("p.name = 3", named):find(
      'scene.lua:2: node "kernel": .*attribute "name" takes a string, not 3'))
    assert.truthy(scene.kernel_error("p.heat = p.name", named .. ", heat = {1, 2}"):find(
      'scene.lua:2: .*attribute "heat" takes a number, not "leaf"'))
    assert.truthy(scene.kernel_error("p.name = 'a\\255b'", named):find(
      'scene.lua:2: .*the string "a\\xffb" of an attribute is not valid UTF%-8'))
    for line, message in pairs {
      [':attribute { attributes = { name = 3 } }'] = "name = 3 has the wrong type; it must be a string in quotes",
      [':attribute { mass = "heavy" }'] = 'mass = "heavy" has the wrong type; it must be a number',
      [':emit { source = two, count = 1, attributes = { kind = { {0, "a"}, {1, "b"} } } }'] =
        'kind: strings can\'t be interpolated; to choose one at random, give a list: {"a", "b"}',
      [':emit { source = two, count = 1, name = "x", attributes = { kind = {"a", 3} } }'] = "kind = ",
      [':detail("d", function(points) points[1].kind = 3 end) :attribute { kind = "a" }'] =
        'attribute "kind" takes a string, not 3',
      [':detail("d", function(points) points:max "kind" end) :attribute { kind = "a" }'] =
        'attribute "kind" is a string, which can\'t be sorted or summed',
      [':points("k", function(p) p.v = p.v * (p.name == "leaf" and 1 or 0) end)'] =
        'no attribute "name"; add :attribute{ attributes = { name = "" } } before it',
    } do
      local text = "return rapid.create { points = two }\n" .. line .. " :solve {}"
      local reported = scene.error(text)
      assert.truthy(reported:find(message, 1, true), reported)
      assert.truthy(reported:find("scene.lua:2", 1, true), reported)
    end
  end)

  it("is not a number: an error says so if a number is required", function()
    local reported = scene.error [[
return rapid.create { points = two } :attribute { kind = "a" } :drag { linear = rapid.attr "kind" } :solve {}]]
    assert.truthy(reported:find('"kind" is string', 1, true), reported)
    reported = scene.error [[
local parents = rapid.create { points = two } :attribute { kind = "a" } :solve { name = "parents" }
return rapid.create {} :spawn { from = parents, on = "kind > 1" } :solve {}]]
    assert.truthy(reported:find('on: "kind" is a string; compare it in a function', 1, true), reported)
  end)
end)

local text = [[
return rapid.create { seed = 5 }
  :emit { source = rapid.mesh.sphere {}, rate = 2000, attributes = { name = {"a", "b"} } }
  :points("grow", function(p, frame)
      if p:rand(1, frame) < 0.1 then p.name = p.name .. (frame.number % 10) end
    end) :gravity {} :solve {}]]

describe("strings", function()
  local function done(name, arguments)
    local result = scene.command(name, text, arguments)
    assert.equal(0, result.status, result.stderr)
    return result.stdout
  end
  local function shell(line)
    local result = command.shell(line, { cwd = scene.folder.path })
    assert.equal(0, result.status, result.stdout .. result.stderr)
    return result.stdout
  end

  it("are in snapshots: a run that goes on writes the same files", function()
    done("run", "-f 1-12 -o whole/a.####.bgeo")
    done("run", "-f 1-6 --cache cache -o part/a.####.bgeo")
    done("run", "-f 1-12 --cache cache -o part/a.####.bgeo")
    shell "diff -r whole part"
  end)

  it("are put together from parts", function()
    done("run", "-f 7-8 -o whole.####.bgeo")
    for part = 1, 2 do done("run", ("-f 7-8 --part %d/2 -o 'p.####.bgeo'"):format(part)) end
    local result = command.rapid("merge -o 'merged.####.bgeo' 'p_part{part}.####.bgeo'", { cwd = scene.folder.path })
    assert.equal(0, result.status, result.stderr)
    for frame = 7, 8 do shell(("cmp whole.%04d.bgeo merged.%04d.bgeo"):format(frame, frame)) end
  end)

  it("are printed by info and diff", function()
    done("run", "-f 3 -o b.vdb -o b.csv -o b.npz")
    local reported = command.rapid("info b.vdb", { cwd = scene.folder.path }).stdout
    assert.truthy(reported:find('name +string  "a" "a2" "a3" "b" "b2"'), reported)
    for _, other in ipairs { "b.csv", "b.npz" } do
      local result = command.rapid("diff b.vdb " .. other, { cwd = scene.folder.path })
      assert.equal(0, result.status, result.stdout .. result.stderr)
    end
  end)

  it("are printed by trace", function()
    local reported = json.decode(done("trace", "--json --id 0 -f 1-6"))
    local name = reported[1].steps[1].values.name
    assert.truthy(name == "a" or name == "b", name)
  end)

  it("are skipped in .ply and .prt files, which is reported once", function()
    local result = scene.command("run", text, "-f 1-4 -o c.####.ply -o c.####.prt -o c.####.bgeo")
    assert.equal(0, result.status, result.stderr)
    for _, extension in ipairs { "ply", "prt" } do
      local warning = 'c%.####%.NAME: %.NAME can\'t store strings, so "name" is not written; use one of ' ..
        "[%.%w, ]*%.csv, [%.%w, ]*%.vtp"
      local _, count = result.stderr:gsub(warning:gsub("NAME", extension), "")
      assert.equal(1, count, result.stderr)
    end
    assert.is_nil(result.stderr:find("c.####.bgeo", 1, true))
  end)

  it("are reported as skipped if they are requested by name, and not otherwise", function()
    local result = scene.command("run", text, "-f 1-4 -o with.####.ply:name -o without.####.ply:v")
    assert.equal(0, result.status, result.stderr)
    assert.matches('with.####.ply: .ply can\'t store strings, so "name" is not written; use one of ', result.stderr, 1,
      true)
    assert.is_nil(result.stderr:find("without.####.ply", 1, true))
  end)
end)
