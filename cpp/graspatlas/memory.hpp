#pragma once

namespace graspatlas {

/// Gives the pages between two addresses back to the system, as far as it takes them; what stood there is lost.
void give_back(void* first, void* last);

/// Gives the free memory of the heap back to the system, as far as it takes it.
void trim_heap();

}  // namespace graspatlas
