!> Labels of the columns of a table, appended one by one in amortised constant time.
module nocdyn_column_labels
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  type, public :: column_labels_t
    integer :: count = 0
    type(string_t), allocatable, private :: list(:)
  contains
    procedure :: add, take
  end type column_labels_t

contains

  !> Appends a label.
  subroutine add(self, label)
    class(column_labels_t), intent(inout) :: self
    character(len=*), intent(in) :: label
    type(string_t), allocatable :: longer(:)
    integer :: i

    if (.not. allocated(self%list)) allocate (self%list(16))
    if (self%count == size(self%list)) then
      allocate (longer(2 * self%count))
      do i = 1, self%count
        call move_alloc(self%list(i)%text, longer(i)%text)
      end do
      call move_alloc(longer, self%list)
    end if
    self%count = self%count + 1
    self%list(self%count)%text = label
  end subroutine add

  !> Hands over all labels.
  subroutine take(self, labels)
    class(column_labels_t), intent(inout) :: self
    type(string_t), allocatable, intent(out) :: labels(:)
    integer :: i

    allocate (labels(self%count))
    do i = 1, self%count
      call move_alloc(self%list(i)%text, labels(i)%text)
    end do
    self%count = 0
  end subroutine take

end module nocdyn_column_labels
