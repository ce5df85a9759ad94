-- A node that needs an attribute made only by a later node: rapid check reports it, and a run fails before any frame.
local scene = require "testing.scene"

local read = ':points("read", function(p) p.v = vec3(p.heat, 0, 0) end) '
local create = "rapid.create { points = two } "

-- Returns the message of the check, which equals that of the run.
local function refused(text)
  local checked = scene.command("check", "return " .. text)
  assert.equal(2, checked.status, checked.stderr)
  local ran = scene.command("run", "return " .. text, "-f 1-3 --quiet")
  assert.equal(2, ran.status)
  assert.equal(checked.stderr, ran.stderr)
  return checked.stderr
end

describe("an attribute", function()
  it("is refused before the node that makes it, where no solve feeds it back", function()
    local later = 'scene.lua:1: node "read": no attribute "heat" here; node "attribute1" at line 1 makes it, but ' ..
      "comes later: move that node before this one\n"
    assert.equal(later, refused(create .. read .. ":solve {} :attribute { heat = 1 }"))
    assert.equal(later, refused(create .. read .. ":attribute { heat = 1 }"))
    assert.equal((later:gsub('"read"', '"spring1"')),
      refused(create .. ':spring { stiffness = rapid.attr "heat" } :solve {} :attribute { heat = 1 }'))
  end)

  it("is there before it, between create and solve, from the first frame on", function()
    local result = scene.run("return " .. create .. read .. ":attribute { heat = 1 } :solve {}")
    assert.equal(1, result[2][1].v.x)
  end)

  it("of a known name has its default there", function()
    local result = scene.run("return " .. create .. ':points("read", function(p) p.v = vec3(p.pscale, 1, 0) end) ' ..
      ":solve {} :attribute { pscale = 0.5 }")
    assert.equal(vec3(0, 1, 0), result[2][1].v)
    assert.equal(0, result[2][1].pscale)
  end)

  it("comes with the points that a merge brings, from the first frame on", function()
    local other = 'rapid.create { points = two, seed = 2 } :attribute { heat = 3 } '
    local result = scene.run("return " .. create .. ":merge(" .. other .. ") " .. read .. ":solve {}")
    assert.equal(3, result[2][4].v.x)
    assert.matches('no attribute "haet"; did you mean "heat"?',
      refused(create .. ":merge(" .. other .. ") " .. read:gsub("heat", "haet") .. ":solve {}"), 1, true)
  end)
end)

describe("an attribute that a node gives behind a merge", function()
  it("is given to all points that have none, known or not", function()
    local given = ":attribute { pscale = 0.5, heat = 3 } "
    for _, chain in ipairs {
      create .. ":solve {} :merge(rapid.create { points = two } :solve {}) " .. given,
      create .. ":merge(rapid.create { points = two }) " .. given .. ":contact {} :solve {}",
    } do
      local points = scene.run("return " .. chain)[2]
      assert.equal(4, #points)
      for i = 1, 4 do
        assert.near(0.5, points[i].pscale, 0)
        assert.equal(3, points[i].heat)
      end
    end
  end)

  it("does not replace the value that a node of their own chain sets", function()
    local points = scene.run("return " .. create .. ":merge(rapid.create { points = two } " ..
      ':points("read", function(p) p.v = vec3(p.mass, 0, 0) end)) :attribute { mass = 7 } :gravity {} :solve {}')[2]
    assert.equal(7, points[1].mass)
    assert.equal(1, points[3].mass)
  end)
end)
