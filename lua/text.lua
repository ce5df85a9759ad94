-- Texts of attributes. A column holds a number for each text, the same for equal ones in the whole process. Each state
-- keeps those that it has met: what a kernel reads and writes is a look-up in a table, which traces hold.
--
-- Functions are vararg, so that no trace starts at them, and compiled, as kernels call them.
local most = 65536 -- that are kept; then it begins anew

-- native.text(number), native.number(text)
local function make(native)
  local texts, numbers, count = {}, {}, 0
  local function keep(...)
    local text, number = ...
    count = count + 1
    if count > most then
      for known in next, texts do texts[known] = nil end
      for known in next, numbers do numbers[known] = nil end
      count = 1
    end
    texts[number], numbers[text] = text, number
  end
  return {
    texts = texts, numbers = numbers,
    text = function(...)
      local number = ...
      local text = texts[number]
      if text == nil then
        text = native.text(number)
        keep(text, number)
      end
      return text
    end,
    number = function(...)
      local text = ...
      local number = numbers[text]
      if number == nil then
        number = native.number(text)
        keep(text, number)
      end
      return number
    end,
  }
end

return { make = make }
