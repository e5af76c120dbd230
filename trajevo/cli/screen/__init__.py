"""What commands show: tables of any width, printed results, bars while something is computed."""
