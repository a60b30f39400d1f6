"""Many designs: keys of a deck that vary, a run a combination; a table, pictures and a page of them all."""
