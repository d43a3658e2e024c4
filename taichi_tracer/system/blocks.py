"""``if IN_A_BLOCK:``: statements with a block of their own, so that a kernel compiles in less time.

Taichi 1.7 lowers a kernel one assignment after the other. After each, it looks for uses of what it has replaced: in the
whole block of the assignment, and in the blocks around it. Therefore the time is the product of the number of all
statements and of the number of those that stand in outer blocks, and a long calculation at the beginning of a kernel is
expensive. In a block of its own, it concerns nobody else. The condition is always true, and LLVM leaves it out: the
machine code stays the same. What is used after the block must get a value before it, as with every ``if`` in Taichi.
"""

IN_A_BLOCK = True
