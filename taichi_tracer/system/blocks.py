"""``if IN_A_BLOCK:``: statements with a block of their own, so that a kernel compiles in less time.

Taichi 1.7 lowers a kernel one assignment after the other. After each, it looks for uses of what it has replaced: in the
whole block of the assignment, and in the blocks around it. Therefore the time is the product of the number of all
statements and of the number of those that stand in the blocks around them, and a long calculation is expensive where
much else follows in the same block, or in blocks within it. In a block of its own, it concerns nobody else.

The condition is always true, and the compiler leaves it out. What is used after the block must have a value before it,
as with every ``if`` in Taichi. This value fixes the type: what the block assigns is converted to it. Therefore no block
stands around a method that a student may replace by one whose result has another type.
"""

IN_A_BLOCK = True
