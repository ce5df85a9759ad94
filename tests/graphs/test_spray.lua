-- graphs/spray.lua: the claims in its header.
describe("graphs/spray.lua", function()
  local result = rapid.run("graphs/spray.lua", { frames = {1, 72}, set = { rate = 3000 } })
  local center, radius, drop, voxel = vec3(0.8, 0.5, 0), 0.5, 0.008, 0.025

  it("keeps each drop's radius from the ball and from the floor", function()
    -- A sphere's level set has an error of at most voxel² / radius between its samples.
    local slack = voxel * voxel / radius
    for frame, points in result:frames() do
      for i = 1, #points do
        local P = points[i].P
        if P.y < drop - 1e-6 or (P - center):length() < radius + drop - slack then
          error(("frame %d, id %d: too near at %s"):format(frame, points[i].id, tostring(P)))
        end
      end
    end
  end)

  it("traps no drop where the ball falls away from under it", function()
    -- Drops that lifted off used to hit the same facet of the level set again and again, up to the contact limit.
    assert.same({}, rapid.run("graphs/spray.lua", { frames = {96, 96} }).warnings)
  end)

  it("pulses: births follow the rate of their frame", function()
    for _, frame in ipairs { 2, 9, 20 } do
      local rate = 3000 * (0.55 + 0.45 * math.cos(9 * (frame - 1) / 24))
      local born = #result[frame] - #result[frame - 1] -- none has died yet
      assert.near(rate / 24, born, 1)
    end
  end)
end)
