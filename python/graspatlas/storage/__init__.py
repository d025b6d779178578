"""What is written and read: files, either whole or not at all, arrays, tables, and what long runs keep."""
