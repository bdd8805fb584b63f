## For jobs of a chain that was submitted as a whole: what follows exit code 5.

go_on() {
    echo "job: the next job of the chain goes on from the checkpoint; was this the last one, submit the script again"
    exit 5
}
