-- Messages and warnings that suggest a correction.
local scene = require "testing.scene"

local points = "rapid.points.from { P = {{0, 1, 0}} }"

local function fault(text)
  return scene.error((text:gsub("POINTS", points)))
end

local function kernel_fault(body)
  return fault(('return rapid.create { points = POINTS } :points("k", function(p, frame) %s end) :solve {}')
    :format(body))
end

local function expect(part, message)
  assert.truthy(message:find(part, 1, true), message)
end

local function warnings(text)
  return table.concat(scene.run((text:gsub("POINTS", points)), { frames = {1, 3} }).warnings, "\n")
end

describe("a message", function()
  it("suggests known attributes with their known types", function()
    expect('no attribute "Cd"; add :attribute{ Cd = {1, 1, 1} } before it', kernel_fault "p.Cd = vec3(1, 0, 0)")
    expect("add :attribute{ orient = {0, 0, 0, 1} } before it", kernel_fault "p.orient = quat(0, 0, 0, 1)")
    expect("add :attribute{ Alpha = 1 } before it", kernel_fault "p.Alpha = 1")
    expect("add :attribute{ heat = 0 } before it", kernel_fault "p.heat = 1")
    expect("add :attribute{ Cd = {1, 1, 1} } before it", kernel_fault 'local name = "C" .. "d" p[name] = vec3(1, 0, 0)')
  end)

  it("suggests an attribute of the type that is assigned or needed", function()
    expect('no attribute "flow"; add :attribute{ flow = {0, 0, 0} } before it', kernel_fault "p.flow = vec3(1, 0, 0)")
    expect("add :attribute{ turn = {0, 0, 0, 1} } before it",
      kernel_fault "local q = quat(0, 0, 0, 1) if p.id > 3 then q = quat(1, 0, 0, 0) end p.turn = quat(0, 1, 0, 0)")
    expect("add :attribute{ goal = {0, 0, 0} } before it",
      fault 'return rapid.create { points = POINTS } :attract { center = rapid.attr "goal" } :solve {}')
    expect("add :attribute{ pull = 0 } before it",
      fault 'return rapid.create { points = POINTS } :attract { strength = rapid.attr "pull" } :solve {}')
  end)

  it("that follows is one with which the scene runs", function()
    for attribute, body in pairs { flow = "p.flow = vec3(1, 0, 0)", turn = "p.turn = quat(0, 1, 0, 0)",
                                   heat = "p.heat = 3", curve = "p.curve = 2" } do
      local advice = kernel_fault(body):match "add (:attribute%b{}) before it"
      assert.truthy(advice, attribute)
      local text = ('return rapid.create { points = POINTS } %s :points("k", function(p) %s end) :solve {}')
        :format(advice, body):gsub("POINTS", points)
      assert.truthy(scene.run(text, { frames = {1, 2} })[2][1][attribute])
    end
  end)

  it("suggests the attribute that has another name elsewhere", function()
    expect('no attribute "colour"; the colour of points is Cd: add :attribute{ Cd = {1, 1, 1} } before it',
      kernel_fault "p.colour = vec3(1, 0, 0)")
    expect('no attribute "position"; the position of points is P', kernel_fault "p.v = p.position")
    expect('no attribute "radius"; the radius of points is pscale', kernel_fault "p.v = p.v * p.radius")
  end)

  it("names the function that sees the neighbours of a point", function()
    expect('p has no method "neighbours", because a kernel sees only one point; use '
      .. "points:neighbours(i, radius)", kernel_fault "for _, k in ipairs(p:neighbours(1)) do p.v = p.v * k end")
  end)

  it("says that a number that changes is a function of the frame", function()
    expect("rate = {0} has the wrong type; it must be a number, or a function of the frame: "
      .. "function(frame) return ... end",
      fault "return rapid.create {} :emit { source = POINTS, rate = {[1] = 0} } :solve {}")
    expect("a function of the frame", fault
      "return rapid.create {} :emit { source = POINTS, rate = {[1] = 0, [24] = 100} } :solve {}")
  end)

  it("closes an open ground before a level set is made of it", function()
    local ground = "local g = rapid.mesh.grid { size = {2, 2} } return rapid.create { points = POINTS } "
      .. ":collide { shape = %s } :solve {}"
    local remedy = "close it: for a ground, add a copy of its outer edge lower down, faces between the two, and a " ..
      "bottom"
    expect("it is open: ", fault(ground:format "g"))
    expect(remedy, fault(ground:format "g"))
    expect(remedy, fault(ground:format "rapid.levelset.from_mesh(g, { voxel = 0.1 })"))
    expect("has no inside that could keep points out; use rapid.levelset.from_mesh(mesh, { voxel = 0.02 })", fault(
      "return rapid.create { points = POINTS } :collide { shape = rapid.mesh.box {} } :solve {}"))
    expect("voxel = 0.2 }", fault(
      "return rapid.create { points = POINTS } :collide { shape = rapid.mesh.box { size = {10, 1, 1} } } :solve {}"))
  end)

  it("suggests frame.time if the frame is used as a number", function()
    local number = "the frame is not a number; use one of its fields, such as frame.time"
    local emit = "return rapid.create {} :emit { source = rapid.mesh.sphere {}, rate = function(frame) %s end } "
      .. ":solve {}"
    expect(number, fault(emit:format "return 5 * frame"))
    expect(number, fault(emit:format "if frame > 5 then return 1 end return 2"))
    expect(number, kernel_fault "p.v = vec3(0, frame * 2, 0)")
    expect("the frame can't be used as a value here; it has frame.time", fault(emit:format "return frame"))
    expect("number expected, got cdata); the frame, a point and a vec3 are not numbers; use frame.time, p.age",
      fault(emit:format "return math.sin(frame)"))
    expect("the frame, a point and a vec3 are not numbers", kernel_fault "p.v = vec3(math.sin(p.P), 0, 0)")
    expect(number, kernel_fault "if frame == 2 then p.v = p.P end")
    expect(number, fault(emit:format "return frame == 2 and 1 or 0"))
    local shown = "the frame (frame.time is a number)"
    for _, text in ipairs {
      kernel_fault "p.v = vec3(0, frame, 0)", kernel_fault "p.v = rapid.math.clamp(frame, 0, 1) * p.P",
      kernel_fault "p.v = rapid.math.noise(p.P, frame) * p.P", kernel_fault "p.v = p.v:lerp(p.P, frame)",
      kernel_fault "p.v = frame",
      fault [[return rapid.create { points = POINTS } :collide { shape = rapid.shape.sphere {},
        transform = function(frame) return rapid.translate(0, frame, 0) end } :solve {}]],
    } do expect(shown, text) end
    expect("the step (step.time is a number)", fault [[return rapid.create { points = POINTS }
      :action("k", function(p, step) p.v = vec3(0, step, 0) end) :solve {}]])
  end)

  it("suggests replacements for random numbers, files and clocks", function()
    expect("use p:rand(k), which is the same in every run", fault "math.random() return rapid.create {} :solve {}")
    expect("p:rand(k)", kernel_fault "p.v = vec3(math.random(), 0, 0)")
    expect("a script can't open files; rapid.points.read", fault "io.open 'a' return rapid.create {} :solve {}")
    expect("use frame.time", fault "os.time() return rapid.create {} :solve {}")
  end)

  it("shows no address, and names where attributes of the newborn go", function()
    expect("rapid.grid.from: at returns 3; it must return a vec3 everywhere",
      fault "rapid.grid.from { at = function() return 3 end } return rapid.create {} :solve {}")
    local emit = "return rapid.create {} :emit { source = rapid.mesh.sphere {}, rate = 5, %s } :solve {}"
    expect('unknown parameter "pscale"; it is an attribute of points: attributes = { pscale = 0 }',
      fault(emit:format "pscale = 0.1"))
    expect("attributes = { Cd = {1, 1, 1} }", fault(emit:format "Cd = {1, 0, 0}"))
    expect("attributes = { mass = 1 }", fault(emit:format "mass = 2"))
    expect("an attribute of points goes into attributes = { heat = 0 }", fault(emit:format "heat = 2"))
    expect('did you mean "rate"?', fault(emit:format "rat = 1"))
  end)

  it("explains numbers without a name, and names without a value", function()
    local emit = "return rapid.create {} :emit { source = %s, rate = %s, attributes = { pscale = %s } } :solve {}"
    expect("0 has no name; write { NAME = value, ... }; a vector is {x, y, z}, and a number has no comma",
      fault(emit:format("{0, 1.5, 0}", "2,000", "0.1")))
    expect("attributes: 15 has no name; write { NAME = value, ... }, and numbers without a comma",
      fault(emit:format("{0, 1.5, 0}", "2000", "0,015")))
    expect("source is missing: object that emits the points (a name without a value counts as missing)",
      fault(emit:format("sky", "2000", "0.1")))
  end)

  it("knows what other programs call a parameter", function()
    local emit = "return rapid.create {} :emit { source = {0, 1.5, 0}, %s } :solve {}"
    expect('unknown parameter "color"; the color of points is Cd: attributes = { Cd = {1, 1, 1} }',
      fault(emit:format "color = {1, 0, 0}"))
    expect('unknown parameter "size"; the size of points is pscale: attributes = { pscale = 0 }',
      fault(emit:format "size = 0.1"))
    expect('unknown parameter "lifetime"; did you mean "life"?', fault(emit:format "lifetime = 2"))
    expect('unknown parameter "amount"; give rate (points per second) or count (points per frame)',
      fault(emit:format "amount = 200"))
  end)

  it("says what may be missing where a scene can't be read", function()
    expect("scene.lua:1: '}' expected near 'attributes'; is a comma missing before attributes?",
      fault "return rapid.create {} :emit { source = POINTS, rate = 9 attributes = {} } :solve {}")
    expect("scene.lua:2: '}' expected (to close '{' at line 1) near 'life'; is a comma missing before life?",
      fault "return rapid.create {} :emit { source = POINTS, rate = 9\n life = 2 } :solve {}")
    expect("a } is missing before the end of the file", fault "return rapid.create { fps = 24")
    expect("is a } missing before the colon?", fault "return rapid.create { fps = 24 :solve {}")
    expect("values and vectors have braces", fault "return rapid.create {} :gravity ( strength = 5 ) :solve {}")
    expect("values and vectors have braces", fault "return rapid.create { fps = (24, 1) } :solve {}")
    expect("are braces {} missing after the name?", fault "return rapid.create {} :gravity :solve {}")
    expect("is a colon missing before solve?", fault "return rapid.create {} solve {}")
    scene.folder:write("forgotten.lua", "return rapid.create {} :solve {}\n")
    expect([[attempt to index global 'rapid' (a nil value); begin the file with: local rapid = require "rapid"]],
      scene.error "require 'forgotten'")
    local wind = "return rapid.create { points = POINTS } :wind { velocity = {%s, 0, 0} } :solve {}"
    expect("the time is frame.time, in function(frame) ... end", fault(wind:format "math.sin(time)"))
    expect("the time is frame.time, in function(frame) ... end", fault(wind:format "2 * time"))
  end)
end)

describe("what a :detail names", function()
  it("is there, also where a method is given its name", function()
    local result = scene.run([[
return rapid.create { points = rapid.points.from { P = {{0, 1, 0}, {0, 2, 0}} } }
  :detail("d", function(points, frame)
    points.detail.oldest, points.detail.weight = points:max "age", points:sum "mass"
  end)
  :attribute { oldest = 0, weight = 0 }
  :points("k", function(p, frame) p.oldest, p.weight = frame.detail.oldest, frame.detail.weight end)
  :solve {}]], { frames = {1, 4} })
    assert.near(2 / 24, result[4][1].oldest, 1e-7)
    assert.equal(2, result[4][1].weight)
  end)
end)

describe("a warning", function()
  it("names the first node that has no effect, as no :solve comes after it", function()
    local text = warnings "return rapid.create { points = POINTS } :gravity {} :wind {}"
    expect('node "gravity1": has no effect, because no :solve comes after it', text)
    assert.falsy(text:find("wind1", 1, true))
    assert.equal("", warnings "return rapid.create { points = POINTS } :gravity {} :solve {}")
    assert.equal("", warnings "return rapid.create { points = POINTS } :attribute { heat = 1 }")
    expect('node "wind1": has no effect', warnings "return rapid.create { points = POINTS } :solve {} :wind {}")
    assert.equal("", warnings [[return rapid.create {} :emit { source = POINTS, rate = 9 } :wind {}
      :merge(rapid.create { points = POINTS }) :solve {}]])
  end)

  it("names a node whose result is dropped", function()
    local dropped = "local c = rapid.create { points = POINTS } :gravity {} c:wind {} %s return c:solve {}"
    expect('node "wind1": leads to no output, because its result is not used; assign it: chain = chain:wind { ... }',
      warnings(dropped:format ""))
    expect('node "k": leads to no output', warnings [[local c = rapid.create { points = POINTS } :gravity {} :solve {}
      c:points("k", function(p) p.v = p.P end) return c]])
    -- Correct uses, for which no warning is given.
    for _, text in ipairs {
      "local c = rapid.create { points = POINTS } :gravity {} local other = c:wind {} :solve {} return c:solve {}",
      "local other = rapid.create { points = POINTS } :wind {} return rapid.create { points = POINTS } :solve {}",
    } do assert.equal("", warnings(text)) end
  end)

  it("names a script that waits for the end of lives which have none", function()
    local chain = "return rapid.create {} :emit { source = POINTS, rate = 9, %s attributes = { Alpha = 1 } } %s "
      .. ":solve {}"
    for name, node in pairs { fade_by_age1 = ":fade_by_age { attribute = 'Alpha' }",
                              ramp1 = ":ramp { from = 'nage', to = 'Alpha', keys = {{0, 1}, {1, 0}} }",
                              k = ":points('k', function(p) p.Alpha = p.nage end)" } do
      expect(('node "%s": needs the life of its points, but they live for ever; give emit a life'):format(name),
        warnings(chain:format("", node)))
      assert.equal("", warnings(chain:format("life = 2,", node)))
    end
  end)

  it("names what makes angular velocities by which nothing turns", function()
    local chain = "return rapid.create {} :emit { source = POINTS, rate = 9, attributes = { w = {0, 1, 0} } } %s "
      .. ":solve {}"
    expect('node "emit1": makes w, but no node turns points by it; add :tumble {}, or give :contact spin = true',
      warnings(chain:format ""))
    assert.equal("", warnings(chain:format ":tumble {}"))
    assert.equal("", warnings(chain:format ":contact { radius = 0.01, spin = true }"))
  end)

  it("names a force after a goal that holds its points", function()
    local chain = "return rapid.create { points = POINTS } %s :goal { to = POINTS %s } %s :solve {}"
    expect('node "wind1": can\'t move the points that have arrived, because goal1 holds them; to let them go, '
      .. "give goal1 hold = false", warnings(chain:format("", "", ":wind { velocity = {2, 0, 0} }")))
    assert.equal("", warnings(chain:format("", ", hold = false", ":wind {}")))
    assert.equal("", warnings(chain:format(":gravity {}", "", "")))
  end)

  it("names attributes that other programs call so, and that nothing reads", function()
    local chain = "return rapid.create {} :emit { source = POINTS, rate = 9, attributes = { %s } } %s :solve {}"
    for name, known in pairs { color = "Cd", size = "pscale", lifetime = "life" } do
      local text = chain:format(name .. " = 0.5", "")
      expect(('node "emit1": gives points "%s", which nothing reads; the %s of points is %s'):format(name, name, known),
        warnings(text))
      assert.equal("", warnings(chain:format(name .. " = 0.5", (":points('k', function(p) p.v = p.v * p.%s end)")
        :format(name))))
    end
  end)

  it("names values that look like another unit", function()
    local chain = "return rapid.create {} :emit { source = rapid.shape.sphere { radius = 0.8 }, rate = 9, %s } " ..
      ":solve {}"
    expect("Cd = {255, 80, 20}: colours go from 0 to 1; divide by 255",
      warnings(chain:format "attributes = { Cd = {255, 80, 20} }"))
    expect("pscale = 4 is a radius in metres, larger than the source; give a smaller one",
      warnings(chain:format "attributes = { pscale = 4 }"))
    expect("life = 48 is in seconds; if frames are meant, divide by 24", warnings(chain:format "life = 48"))
    local fading = "return rapid.create { points = rapid.points.from { P = {{0, 1, 0}}, life = {2}, Alpha = {1} } } "
      .. ":fade_by_age { %s } :solve {}"
    for _, given in ipairs { "", "attribute = 'pscale', hold = 0.5" } do
      expect("sets pscale to 1 at birth, which is a radius of 1 m; give first, such as first = 0.02",
        warnings(fading:format(given)))
    end
    for _, given in ipairs { "first = 1", "attribute = 'Alpha'" } do
      assert.equal("", warnings(fading:format(given)))
    end
    assert.equal("", warnings(chain:format "life = {1, 20}, attributes = { Cd = {12, 1, 0}, pscale = 0.5 }"))
  end)

  it("names a range of w that turns all points about one axis", function()
    local chain = "return rapid.create {} :emit { source = POINTS, rate = 9, %s } :tumble {} :solve {}"
    expect('node "emit1": w = {{-5, -5, -5}, {5, 5, 5}} turns all points about one axis, because values are drawn on '
      .. "the line between the two vectors; leave w out and use :tumble { speed = 360 }, or set p.w in "
      .. "birth = function(p) ... end", warnings(chain:format "attributes = { w = {{-5, -5, -5}, {5, 5, 5}} }"))
    for _, given in ipairs {
      "attributes = { w = {{0, -5, 0}, {0, 5, 0}} }", "attributes = { w = {{1, 2, 3}, {2, 3, 4}} }",
      "attributes = { w = {1, 2, 3} }", "attributes = { w = {1, 2, 3}, Cd = {{-1, -1, -1}, {1, 1, 1}} }",
      "birth = function(p) p.w = vec3(10 * p:rand(1) - 5, 10 * p:rand(2) - 5, 10 * p:rand(3) - 5) end",
    } do assert.equal("", warnings(chain:format(given))) end
  end)

  it("names a kernel that moves points whose v stays 0", function()
    local chain = "return rapid.create {%s} :emit { source = rapid.mesh.sphere {}, rate = 99, %s } "
      .. ":points('k', function(p, frame) %s end) %s :solve {}"
    local moves = "p.P = vec3(math.sin(frame.time + p.id), 0, 0)"
    local warning = 'node "k": moves P but leaves v at 0, so files and motion blur have no velocities; instead '
      .. "of p.P assign p.v = (position - p.P) / frame.dt, and :solve moves the point there"
    expect(warning, warnings(chain:format("", "", moves, "")))
    expect(warning, warnings(chain:format("points = POINTS", "birth = function(p) p.P = p.P * 2 end", moves, "")))
    for _, text in ipairs {
      chain:format("", "velocity = {0, 1, 0}", moves, ""), chain:format("", "speed = 1", moves, ""),
      chain:format("", "birth = function(p) p.v = p.P end", moves, ""),
      chain:format("points = rapid.points.from { P = {{0, 1, 0}}, v = {{0, 1, 0}} }", "", moves, ""),
      chain:format("", "", moves .. " p.v = vec3(math.cos(frame.time + p.id), 0, 0)", ""),
      chain:format("", "", moves, ":gravity {}"),
      chain:format("", "", moves, ":points('w', function(p) p.v = p.P end)"),
      chain:format("", "", "p.v = p.P", ""), chain:format("", "", "", ":action('a', function(p) p.P = p.P * 2 end)"),
      chain:format("", "birth = function(p) p.P = p.P * 2 end", "", ""),
      "return rapid.create { points = POINTS } :solve {} :points('k', function(p) p.P = p.P * 2 end)",
    } do assert.equal("", warnings(text)) end
    -- The scene that follows the advice has the same positions and velocities.
    local function frame_of(text) return scene.run(chain:format("", "", text, ""), { frames = {1, 9} })[9] end
    local moved = frame_of "local place = vec3(frame.time * p.id, 1, 0) p.P = place"
    local driven = frame_of "local place = vec3(frame.time * p.id, 1, 0) p.v = (place - p.P) / frame.dt"
    assert.truthy(#moved > 20)
    for k = 1, 20 do
      assert.near(moved[k].P.x, driven[k].P.x, 1e-5)
      assert.near(0, moved[k].v.x, 0)
      assert.near(driven[k].id, driven[k].v.x, 1e-3)
    end
  end)

  it("names the emitter whose points are gone after a frame, as no :solve comes after it", function()
    expect('node "emit1": its points exist only in the frame of their birth, because no :solve comes after it',
      warnings "return rapid.create {} :emit { source = rapid.mesh.sphere {}, rate = 100 }")
  end)

  it("names the node that reads contacts which no collider records", function()
    local chain = "local chain = rapid.create { points = POINTS } :collide { shape = rapid.shape.plane {}%s }"
    local reads = chain .. ":points('k', function(p) if p.hitnum > 0 then p.v = p.v * 2 end end) :solve {} return chain"
    local bears = chain .. ":solve {} return rapid.create {} :spawn { from = chain, on = 'hittotal >= 2' } :solve {}"
    expect('node "k": reads hitnum, which no collider writes; give :collide record = true',
      warnings(reads:format ""))
    expect('node "emit1": reads hittotal, which no collider writes', warnings(bears:format ""))
    for _, text in ipairs { reads, bears } do assert.equal("", warnings(text:format ", record = true")) end
  end)

  it("names the collider or emitter if all points die at birth", function()
    local scene_text = [[return rapid.create {}
  :emit { source = rapid.mesh.sphere { radius = 1 }, rate = 2000, attributes = { pscale = 0.1 } }
  :collide { shape = rapid.shape.sphere { radius = %s }, response = "die" } :solve {}]]
    expect('node "collide1": kills all points at birth', warnings(scene_text:format "1"))
    assert.equal("", warnings(scene_text:format "0.5"))
    local short = "return rapid.create {} :emit { source = rapid.mesh.sphere {}, rate = 2000, life = %g } :solve {}"
    for _, life in ipairs { 0, 1e-6 } do
      expect('node "solve1": all points die in the frame of their birth; give them a longer life',
        warnings(short:format(life)))
    end
    assert.equal("", warnings(short:format(0.03)))
  end)

  it("reports a voxel that is as large as half of the mesh", function()
    local text = "rapid.levelset.from_mesh(rapid.mesh.box { size = {0.2, 0.2, 0.2} }, { voxel = %g }) "
      .. "return rapid.create { points = POINTS } :solve {}"
    local function reported(voxel)
      return scene.command("check", (text:format(voxel):gsub("POINTS", points))).stderr
    end
    expect("a voxel of 0.11 m is at least half as large as mesh", reported(0.11))
    assert.falsy(reported(0.05):find("voxel", 1, true))
  end)
end)
