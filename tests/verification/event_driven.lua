-- Hard spheres in a box, advanced event by event without a time step: the reference for contacts.
--
--   local gas = event_driven.gas { P = ..., v = ..., mass = ..., radius = r, half = half, bounce = e }
--   gas:advance(time)         to that time, s
--   gas:energy()              J
--
-- P and v are lists of {x, y, z}. The box's walls, at -half and half of each axis, are elastic. Between hits spheres
-- move in straight lines. The next hit of each sphere is stored (Lubachevsky 1991). A hit invalidates those of its two
-- spheres and of all spheres that had one of them as partner.
local event_driven = {}

local Gas = {}
Gas.__index = Gas

function event_driven.gas(given)
  local gas = setmetatable({ n = #given.P, radius = given.radius, half = given.half - given.radius,
    bounce = given.bounce, now = 0, x = {}, u = {}, mass = {}, since = {}, next_time = {}, partner = {} }, Gas)
  for i = 1, gas.n do
    gas.x[i], gas.u[i] = { unpack(given.P[i]) }, { unpack(given.v[i]) }
    gas.mass[i], gas.since[i] = given.mass and given.mass[i] or 1, 0
  end
  for i = 1, gas.n do gas:predict(i) end
  return gas
end

-- Advances only this sphere, to time t.
function Gas:move(i, t)
  local x, u, dt = self.x[i], self.u[i], t - self.since[i]
  for k = 1, 3 do x[k] = x[k] + u[k] * dt end
  self.since[i] = t
end

-- Returns the time at which i and j, which are apart, first touch.
function Gas:meeting(i, j)
  local a, b, va, vb, now = self.x[i], self.x[j], self.u[i], self.u[j], self.now
  local dta, dtb = now - self.since[i], now - self.since[j]
  local along, speed2, distance2 = 0, 0, 0
  for k = 1, 3 do
    local d = a[k] + va[k] * dta - b[k] - vb[k] * dtb
    local w = va[k] - vb[k]
    along, speed2, distance2 = along + d * w, speed2 + w * w, distance2 + d * d
  end
  if along >= 0 then return math.huge end
  local root = along * along - speed2 * (distance2 - 4 * self.radius ^ 2)
  if root < 0 then return math.huge end
  return now + math.max(0, (-along - math.sqrt(root)) / speed2)
end

-- Finds the next hit of i: with another sphere (partner j) or with a wall (partner -axis).
function Gas:predict(i)
  local x, u, time, partner = self.x[i], self.u[i], math.huge, 0
  for k = 1, 3 do
    if u[k] ~= 0 then
      local t = self.since[i] + ((u[k] > 0 and self.half or -self.half) - x[k]) / u[k]
      if t < time then time, partner = t, -k end
    end
  end
  for j = 1, self.n do
    if j ~= i then
      local t = self:meeting(i, j)
      if t < time then time, partner = t, j end
    end
  end
  self.next_time[i], self.partner[i] = time, partner
end

function Gas:hit(i, j)
  local n, closing, size = {}, 0, 0
  for k = 1, 3 do n[k] = self.x[i][k] - self.x[j][k] size = size + n[k] ^ 2 end
  for k = 1, 3 do n[k] = n[k] / math.sqrt(size) closing = closing + n[k] * (self.u[i][k] - self.u[j][k]) end
  local impulse = -(1 + self.bounce) * closing / (1 / self.mass[i] + 1 / self.mass[j])
  for k = 1, 3 do
    self.u[i][k] = self.u[i][k] + impulse / self.mass[i] * n[k]
    self.u[j][k] = self.u[j][k] - impulse / self.mass[j] * n[k]
  end
end

function Gas:advance(time)
  while true do
    local i, t = 0, math.huge
    for k = 1, self.n do
      if self.next_time[k] < t then i, t = k, self.next_time[k] end
    end
    if t > time then break end
    local j = self.partner[i]
    self.now = t
    self:move(i, t)
    if j > 0 then
      self:move(j, t)
      self:hit(i, j)
    else
      self.u[i][-j] = -self.u[i][-j]
    end
    local again = { i, j > 0 and j or nil }
    for k = 1, self.n do
      if k ~= i and k ~= j and (self.partner[k] == i or j > 0 and self.partner[k] == j) then again[#again + 1] = k end
    end
    for _, k in ipairs(again) do self:predict(k) end
    -- The new partner may have had a later hit with another sphere.
    for _, k in ipairs { i, j > 0 and j or nil } do
      local partner = self.partner[k]
      if partner > 0 and self.next_time[k] < self.next_time[partner] then
        self.next_time[partner], self.partner[partner] = self.next_time[k], k
      end
    end
  end
  for i = 1, self.n do self:move(i, time) end
  self.now = time
end

function Gas:energy()
  local sum = 0
  for i = 1, self.n do
    for k = 1, 3 do sum = sum + self.mass[i] / 2 * self.u[i][k] ^ 2 end
  end
  return sum
end

return event_driven
