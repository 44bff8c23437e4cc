"""`python -m tumble`: the command, where its script is not on the path."""

from tumble.cli.console import main

if __name__ == "__main__":
    main()
