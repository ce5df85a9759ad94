-- Formats values for messages. Graph code reads messages too (pcall), so they contain no addresses.
local describe = {}

-- Returns "nil", "a number", "a table".
function describe.kind(value)
  return value == nil and "nil" or "a " .. type(value)
end

-- Formats frames and steps, which are easily mistaken for numbers, with one of their fields.
local function text_of_cdata(value)
  local text = tostring(value)
  if text:find "^frame " then return "the frame (frame.time is a number)" end
  if text == "a step" then return "the step (step.time is a number)" end
  return text
end

-- Returns a short value as it is written, and any other by its type.
function describe.value(value)
  local kind = type(value)
  if kind == "string" then return ("%q"):format(value) end
  if kind == "cdata" then return text_of_cdata(value) end
  if kind == "number" or kind == "boolean" then return tostring(value) end
  return describe.kind(value)
end

-- Returns an operand of a formula: a number or a vec3 as it is written, any other by its type.
function describe.operand(value)
  local kind = type(value)
  if kind == "number" or kind == "cdata" then return describe.value(value) end
  return describe.kind(value)
end

-- Returns a value that was used as a name.
function describe.name(value)
  return type(value) == "string" and value or describe.value(value)
end

return describe
